"""Points on object, terrain and ground that the interaction mesh connects with the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.demonstrations.surface import closest_points
from omni_envs.retargeting import kernels
from omni_envs.scenes import Terrain

# Upward faces carry feet, hands and knees: they get this many times the points per area of others.
_TOP_WEIGHT = 4.0
# Without object and terrain: 9 × 9 jittered ground points, 0.28 m apart at human scale, around the
# body.
_GROUND_CELLS, _GROUND_SPACING = 9, 0.28
_CLEAR = 0.02  # m: ground points keep this far from terrain


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Corresponding points of source and target surroundings.

    Attributes:
        source: (N, 3) or (T, N, 3) points in the frame of the source object, or the world without
            one.
        target: The same for the target object.
    """

    source: np.ndarray
    target: np.ndarray


def surface_points(source: SourceMotion, count: int, ground: int = 0) -> SurfacePoints:
    """Chooses the surface points of a source: on object, else terrain and ground, else ground.

    Deterministic. Object points keep their place when the object shrinks by the source's scale.

    Args:
        source: The motion.
        count: Number of points on object or terrain.
        ground: Most points on the ground beside terrain.
    """
    target = source.scene
    original = source.original_scene or target
    if original.object is not None and target.object is not None:
        at = _spread(original.object.surface(), count, top_weight=1.0)
        points = at.on(original.object.surface())
        return SurfacePoints(points * source.scale, at.on(target.object.surface()))
    if original.terrain is not None and target.terrain is not None:
        at = _spread(original.terrain.surface(), count, top_weight=_TOP_WEIGHT)
        before, after = original.terrain.surface(), target.terrain.surface()
        terrain = SurfacePoints(at.on(before), at.on(after))
        if not ground:
            return terrain
        beside = _ground_beside(source, original.terrain, ground)
        # Ground goes with the nearest corner of the terrain, where a variation has moved that.
        _, corner = cKDTree(before.vertices[:, :2]).query(beside[:, :2])
        shift = (np.asarray(after.vertices) - before.vertices)[corner] * (1.0, 1.0, 0.0)
        return SurfacePoints(
            np.concatenate([terrain.source, beside]),
            np.concatenate([terrain.target, beside + shift]),
        )
    points = _ground(source.keypoints[:, 0, :2], _GROUND_SPACING * source.scale)
    return SurfacePoints(points, points)


@dataclass(frozen=True, eq=False)
class _Places:
    """(N,) faces and (N, 3) barycentric weights: places that a surface of another size has too."""

    faces: np.ndarray
    weights: np.ndarray

    def on(self, surface: trimesh.Trimesh) -> np.ndarray:
        """(N, 3) points of a surface."""
        return np.einsum("nk,nkd->nd", self.weights, surface.triangles[self.faces])


def _spread(surface: trimesh.Trimesh, count: int, top_weight: float) -> _Places:
    """``count`` evenly spread places: farthest-point choice among random ones."""
    rng = np.random.default_rng(0)
    normals, areas = surface.face_normals, surface.area_faces
    face = rng.choice(len(areas), size=30 * count, p=areas / areas.sum())
    u, v = np.sqrt(rng.random(face.size)), rng.random(face.size)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    candidates = _Places(face, weights).on(surface)
    # Density goes with the inverse square of the spacing.
    stretch = np.where(normals[face, 2] > 0.7, np.sqrt(top_weight), 1.0)
    chosen = kernels.farthest_points(candidates, stretch, count)
    return _Places(face[chosen], weights[chosen])


def _ground_beside(source: SourceMotion, terrain: Terrain, count: int) -> np.ndarray:
    """(N, 3) points of the jittered grid near the way of the body and not under terrain."""
    grid = _ground(source.keypoints[:, 0, :2], _GROUND_SPACING * source.scale)
    candidates = np.unique(grid.reshape(-1, 3), axis=0)
    _, distance = closest_points(terrain.parts, candidates)
    free = distance > _CLEAR
    if terrain.heightfield is not None:
        free &= terrain.heightfield.height_at(candidates[:, :2]) < _CLEAR
    candidates = candidates[free]
    if len(candidates) <= count:
        return candidates
    return candidates[kernels.farthest_points(candidates, np.ones(len(candidates)), count)]


def _ground(centres: np.ndarray, spacing: float) -> np.ndarray:
    """(T, N, 3) points of one fixed jittered grid, those near each (T, 2) centre."""
    offsets = np.arange(_GROUND_CELLS) - _GROUND_CELLS // 2
    grid = np.stack(np.meshgrid(offsets, offsets, indexing="ij"), axis=-1).reshape(-1, 2)
    cells = np.floor(centres / spacing).astype(np.int64)[:, None] + grid
    # A hash of the cell, not a random stream: a cell keeps its point when the body comes back to
    # it. The jitter avoids cospherical points, for which the Delaunay mesh is arbitrary.
    seed = cells[..., 0] * 73856093 ^ cells[..., 1] * 19349663
    jitter = np.stack([(seed * k % 10007) / 10007.0 for k in (7919, 104729)], axis=-1)
    xy = (cells + 0.2 + 0.6 * jitter) * spacing
    return np.concatenate([xy, np.zeros((*xy.shape[:2], 1))], axis=-1)
