"""A source motion in another scene: an object that starts elsewhere, other sizes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import trimesh

from omni_envs import rotations
from omni_envs.demonstrations.resampling import FPS
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.demonstrations.surface import closest_points
from omni_envs.demonstrations.variation import Variation
from omni_envs.errors import InvalidOptionError
from omni_envs.robots import KEYPOINTS, SIDES
from omni_envs.scenes import Box, ConvexMesh, Part, SceneObject, Terrain

_ONSET = 0.075
"""An object whose pose (m, quaternion) changes faster than this per second has begun to move."""

_NEAR, _FAR = 0.4, 1.4
"""Distances of hands and object (m, human scale) at which it counts fully, and not at all."""


def vary(source: SourceMotion, variation: Variation) -> SourceMotion:
    """Changes the target scene of a source motion.

    The object's pose becomes p(t) + Δp·exp(-(t - t_m)/τ), with the full shift until it begins to
    move at t_m, and likewise for its turn about the vertical (OmniRetarget, appendix). An object of
    A human far away from the object does not interact with it: there the mesh sees it where it was,
    and comes to see it where it is on the way to it. An object of
    another size keeps the height of its lowest point. Touched points go with the surface. A foot
    that stands after the first step stands on the first frame, too: there it shall start.

    Args:
        source: The motion, not varied before.
        variation: What to change.

    Raises:
        InvalidOptionError: The scene lacks what is to be changed, or has a height field whose depth
            cannot be.
    """
    if variation == Variation():
        return source
    if source.original_scene is not None:
        raise InvalidOptionError(f"Source {source.name!r} is a variation already.")
    scene, poses = source.scene, source.object_poses
    if (variation.moves_object or variation.shapes_object) and (
        scene.object is None or poses is None
    ):
        raise InvalidOptionError(
            f"variation {variation.name!r}: {source.name!r} has no object to change."
        )
    if variation.shapes_terrain and scene.terrain is None:
        raise InvalidOptionError(
            f"variation {variation.name!r}: {source.name!r} has no terrain to change."
        )
    points: Mapping[str, np.ndarray] = source.contact_points
    seen: np.ndarray | None = None
    if scene.object is not None and poses is not None:
        if variation.moves_object:
            poses = _moved(source, poses, variation)
            seen = _seen(source, poses)
        if variation.shapes_object:
            scale = np.array(variation.object_scale)
            shaped = scene.object.scaled(scale)
            poses = _standing(poses, scene.object, shaped)
            seen = None if seen is None else _standing(seen, scene.object, shaped)
            scene = replace(scene, object=shaped)
            points = {link: at * scale for link, at in points.items()}
    if scene.terrain is not None and variation.shapes_terrain:
        stretch = _Stretch.of(source, scene.terrain, variation)
        points = {link: stretch.points(at) for link, at in points.items()}
        scene = replace(scene, terrain=stretch.terrain(scene.terrain))
    return replace(
        source,
        name=f"{source.name}_{variation.name}",
        scene=scene,
        original_scene=source.scene if scene is not source.scene else None,
        object_poses=poses,
        mesh_object_poses=seen,
        contact_points=points,
        stance={mode: _from_the_start(at, source.fps) for mode, at in source.stance.items()},
    )


def _from_the_start(stance: np.ndarray, fps: float) -> np.ndarray:
    """Stance looks back, so no schedule has its first step; this one has it where it goes on."""
    step = min(int(np.ceil(fps / FPS - 1e-9)), len(stance) - 1)
    return np.concatenate([np.repeat(stance[step : step + 1], step, axis=0), stance[step:]])


def _moved(source: SourceMotion, poses: np.ndarray, variation: Variation) -> np.ndarray:
    ahead = poses[0, :2] - source.keypoints[0, KEYPOINTS.index("pelvis"), :2]
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
    forward, left = variation.object_translation
    shift = forward * ahead + left * np.array([-ahead[1], ahead[0]])
    steps = source.fps * np.linalg.norm(np.diff(poses, axis=0), axis=1)
    moving = np.flatnonzero(steps > _ONSET)
    onset = int(moving[0]) if len(moving) else len(poses)
    since = np.maximum(np.arange(len(poses)) - onset, 0) / source.fps
    poses = poses.copy()
    poses[:, :2] += np.exp(-since / variation.position_decay)[:, None] * shift
    turn = np.zeros((len(poses), 3))
    turn[:, 2] = variation.object_yaw * np.exp(-since / variation.yaw_decay)
    poses[:, 3:] = rotations.multiply(rotations.exp(turn), poses[:, 3:])
    return poses


def _seen(source: SourceMotion, poses: np.ndarray) -> np.ndarray:
    """Poses that the mesh sees: the old ones far from the object, the new ones near to it."""
    old, here = source.object_poses, source.source_object_poses
    assert old is not None and here is not None and source.scene.object is not None
    hands = source.keypoints[:, [KEYPOINTS.index(f"{side}_hand") for side in SIDES]]
    back = rotations.conjugate(here[:, None, 3:])
    local = rotations.rotate(back, hands - here[:, None, :3]).reshape(-1, 3)
    parts = source.scene.object.scaled(source.scale).parts
    distance = closest_points(parts, local)[1].reshape(-1, 2).min(axis=1)
    nearness = np.clip((_FAR * source.scale - distance) / ((_FAR - _NEAR) * source.scale), 0.0, 1.0)
    weight = nearness**2 * (3.0 - 2.0 * nearness)
    position = old[:, :3] + weight[:, None] * (poses[:, :3] - old[:, :3])
    return np.hstack([position, rotations.slerp(old[:, 3:], poses[:, 3:], weight)])


def _standing(poses: np.ndarray, before: SceneObject, after: SceneObject) -> np.ndarray:
    """Poses at which the lowest point stays at its height."""

    def lowest(thing: SceneObject) -> np.ndarray:
        corners = np.asarray(thing.surface().vertices)
        return rotations.rotate(poses[:, None, 3:], corners)[..., 2].min(axis=1)

    poses = poses.copy()
    poses[:, 2] += lowest(before) - lowest(after)
    return poses


@dataclass(frozen=True, eq=False)
class _Stretch:
    """Heights × ``height``; lengths along ``axis`` × ``depth`` from the near edge on.

    Attributes:
        axis: (2,) horizontal unit vector away from the human.
        near: Where the terrain begins along it, m.
        far: Where it ends, m.
        height: Factor of heights.
        depth: Factor of lengths.
    """

    axis: np.ndarray
    near: float
    far: float
    height: float
    depth: float

    @classmethod
    def of(cls, source: SourceMotion, terrain: Terrain, variation: Variation) -> _Stretch:
        corners = np.asarray(terrain.surface().vertices)
        pelvis = source.keypoints[0, KEYPOINTS.index("pelvis"), :2]
        ahead = 0.5 * (corners[:, :2].min(axis=0) + corners[:, :2].max(axis=0)) - pelvis
        # Along a side of the terrain, so that a platform stays a box.
        frame, _ = trimesh.bounds.oriented_bounds_2D(corners[:, :2])
        axis = max((*frame[:2, :2], *-frame[:2, :2]), key=lambda a: float(a @ ahead))
        along = corners[:, :2] @ axis
        return cls(
            axis, along.min(), along.max(), variation.terrain_height, variation.terrain_depth
        )

    def points(self, points: np.ndarray) -> np.ndarray:
        """Where (…, 3) points of terrain or ground go; NaN stays NaN."""
        along = points[..., :2] @ self.axis
        gain = (self.depth - 1.0) * np.clip(along - self.near, 0.0, self.far - self.near)
        moved = points.copy()
        moved[..., :2] += gain[..., None] * self.axis
        moved[..., 2] *= self.height
        return moved

    def terrain(self, terrain: Terrain) -> Terrain:
        """The stretched terrain; boxes along the axis stay boxes."""
        if terrain.heightfield is not None and self.depth != 1.0:
            raise InvalidOptionError("terrain_depth: a height field has no depth; use 1.")
        field = terrain.heightfield
        scaled = None if field is None else field.scaled(np.array([1.0, 1.0, self.height]))
        return Terrain(tuple(self._part(part) for part in terrain.parts), scaled)

    def _part(self, part: Part) -> Part:
        mesh = part.mesh()
        moved = self.points(np.asarray(mesh.vertices))
        if isinstance(part.shape, Box):
            sides = rotations.rotate(np.asarray(part.quaternion), np.eye(3))
            scale = np.array([np.linalg.norm(self._linear(s)) for s in sides])
            if all(np.linalg.norm(np.cross(self._linear(s), s)) < 1e-9 for s in sides):
                middle = 0.5 * (moved.min(axis=0) + moved.max(axis=0))
                return Part(part.shape.scaled(scale), tuple(middle), part.quaternion)
        return Part(ConvexMesh(moved, np.asarray(mesh.faces)))

    def _linear(self, side: np.ndarray) -> np.ndarray:
        stretched = side.copy()
        stretched[:2] += (self.depth - 1.0) * (side[:2] @ self.axis) * self.axis
        stretched[2] *= self.height
        return stretched
