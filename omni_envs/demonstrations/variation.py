"""Augmentation: the same human motion with another object or terrain (OmniRetarget, section III-B).

A variation changes the *target* scene of a source motion. The source keeps its interaction mesh, so
minimising the deformation carries the interaction over to the changed scene.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import trimesh

from omni_envs import rotations
from omni_envs.demonstrations.resampling import FPS
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.demonstrations.surface import closest_points
from omni_envs.errors import InvalidOptionError
from omni_envs.robots import KEYPOINTS, SIDES
from omni_envs.scenes import Box, ConvexMesh, Part, SceneObject, Terrain

_ONSET = 0.075
"""An object whose pose (m, quaternion) changes faster than this per second has begun to move."""

_NEAR, _FAR = 0.4, 1.4
"""Distances of hands and object (m, human scale) at which it counts fully, and not at all."""


@dataclass(frozen=True)
class Variation:
    """How a scene differs from that of the demonstration.

    Attributes:
        object_translation: Where the object starts instead: m forward and m to the left, seen from
            the human who faces it on the first frame.
        object_yaw: Turn of the object about the vertical at the start, rad.
        object_scale: Size of the object along its own axes.
        terrain_height: Height of the terrain.
        terrain_depth: Depth of the terrain, away from the edge that the human comes to.
        position_decay: Time in which the shift falls to 1/e once the object moves, s
            (OmniRetarget: 50 frames at 30 fps).
        yaw_decay: The same for the turn, s (OmniRetarget: 25 frames).
    """

    object_translation: tuple[float, float] = (0.0, 0.0)
    object_yaw: float = 0.0
    object_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    terrain_height: float = 1.0
    terrain_depth: float = 1.0
    position_decay: float = 50.0 / 30.0
    yaw_decay: float = 25.0 / 30.0

    def __post_init__(self) -> None:
        for name, size in (("object_translation", 2), ("object_scale", 3)):
            value = np.atleast_1d(np.asarray(getattr(self, name), float))
            if value.shape != (size,) or not np.isfinite(value).all():
                raise InvalidOptionError(f"{name}: expected {size} finite numbers; got {value}.")
            object.__setattr__(self, name, tuple(float(v) for v in value))
        if not np.isfinite(self.object_yaw):
            raise InvalidOptionError(f"object_yaw: expected rad; got {self.object_yaw}.")
        positive = {f.name: getattr(self, f.name) for f in fields(self)[3:]}
        positive |= {"object_scale": min(self.object_scale)}
        for name, value in positive.items():
            if not 0 < value < np.inf:
                raise InvalidOptionError(f"{name}: expected a positive number; got {value}.")

    @property
    def moves_object(self) -> bool:
        """Whether the object starts elsewhere."""
        return any(self.object_translation) or self.object_yaw != 0.0

    @property
    def shapes_object(self) -> bool:
        """Whether the object has another size."""
        return self.object_scale != (1.0, 1.0, 1.0)

    @property
    def shapes_terrain(self) -> bool:
        """Whether the terrain has another size."""
        return (self.terrain_height, self.terrain_depth) != (1.0, 1.0)

    @property
    def name(self) -> str:
        """What is different, for file names; ``"nominal"`` where nothing is."""
        words = []
        if any(self.object_translation):
            words.append("move_" + "_".join(f"{v:+.2f}" for v in self.object_translation))
        if self.object_yaw:
            words.append(f"turn_{np.rad2deg(self.object_yaw):+.0f}")
        if self.shapes_object:
            words.append("size_" + "_".join(f"{v:.2f}" for v in self.object_scale))
        for label, value in (("height", self.terrain_height), ("depth", self.terrain_depth)):
            if value != 1.0:
                words.append(f"{label}_{value:.2f}")
        return "_".join(words) or "nominal"


POSES = tuple(
    Variation(object_translation=(x, y), object_yaw=float(np.deg2rad(yaw)))
    for x, y, yaw in ((0.2, 0, 0), (0, 0.2, 0), (0, -0.2, 0), (0, 0.2, 45), (0, -0.2, -45))
)
"""The five starts of the object in OmniRetarget's dataset: moved by 0.2 m, or moved and turned."""

HEIGHTS = tuple(Variation(terrain_height=h) for h in (0.8, 0.9, 1.0, 1.1, 1.2))
"""The five heights of a terrain in OmniRetarget's dataset."""


def variation_grid(**values: Sequence[Any]) -> Iterator[Variation]:
    """Yields all combinations, e.g. ``variation_grid(terrain_height=(0.9, 1), object_yaw=(0, 1))``.

    Raises:
        InvalidOptionError: No such field.
    """
    _check_names(values)
    for combination in itertools.product(*values.values()):
        yield Variation(**dict(zip(values, combination, strict=True)))


def sample_variations(
    count: int, rng: np.random.Generator, **ranges: tuple[Any, Any]
) -> list[Variation]:
    """Returns random variations, uniform in each range.

    Args:
        count: How many.
        rng: Source of randomness.
        **ranges: Field to (lowest, highest), per component where the field has several.

    Raises:
        InvalidOptionError: No such field, or a range that is none.
    """
    _check_names(ranges)
    for name, limits in ranges.items():
        if len(limits) != 2 or np.any(np.asarray(limits[0]) > np.asarray(limits[1])):
            raise InvalidOptionError(f"{name}: expected (lowest, highest); got {limits}.")

    def draw(low: Any, high: Any) -> Any:
        value = rng.uniform(low, high)
        return float(value) if np.ndim(value) == 0 else tuple(float(v) for v in value)

    return [Variation(**{k: draw(*v) for k, v in ranges.items()}) for _ in range(count)]


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


def _check_names(values: Mapping[str, Any]) -> None:
    valid = [f.name for f in fields(Variation)]
    for name in values:
        if name not in valid:
            raise InvalidOptionError(f"{name}: no field of a variation; fields: {valid}.")


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
