"""What the human's feet do while they stand, and what they stand on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.demonstrations.stance import stance_intervals
from omni_envs.demonstrations.surface import closest_points
from omni_envs.robots import KEYPOINTS, SIDES
from omni_envs.scenes import Terrain

# The surface under a toe is probed from this high above it, at four places this far from it (m).
# Where they find normals further apart than this (rad), or steeper ones, as at an edge, the support
# counts as level; so it does where there is nothing near (m): a variation has moved it away.
_ABOVE, _AROUND, _FLAT, _STEEP = 0.03, 0.02, np.deg2rad(5.0), 0.5
_NEAR = 0.06
# A foot stands flat where the line from toe to ankle rises between these angles (rad; 0.4 on most
# skeletons) and the shin by more than this part of its length: kneeling people's feet lie.
_LEAST, _MOST, _SHIN = 0.05, 0.60, 0.5


@dataclass(frozen=True, eq=False)
class HumanFeet:
    """Standing human feet at robot scale.

    Attributes:
        pivots: (T, 2) bool, they roll or turn on their toes: see ``pivot_schedule``.
        rise: (T, 2) height of the toes above their lowest place in this stance so far, m.
        axes: (T, 2, 2, 3) world x and y as unit vectors laid into the surface that each foot came
            to stand on: along these a standing foot must not move.
        support: (T, 2) height of that surface along its normal, over the plane through the origin,
            m; infinite where a foot stands on nothing.
        flat: (T, 2) bool, the foot stands flat on it.
    """

    pivots: np.ndarray
    rise: np.ndarray
    axes: np.ndarray
    support: np.ndarray
    flat: np.ndarray

    @classmethod
    def of(cls, source: SourceMotion, standing: np.ndarray) -> HumanFeet:
        """Takes from a source what its feet do in a (T, 2) schedule."""
        toes, ankles, knees = (
            source.keypoints[:, [KEYPOINTS.index(f"{side}_{joint}") for side in SIDES]]
            for joint in ("toe", "ankle", "knee")
        )
        support, flat = np.full(standing.shape, np.inf), np.zeros(standing.shape, bool)
        rise, axes = np.zeros(standing.shape), np.tile(np.eye(3)[:2], (*standing.shape, 1, 1))
        runs = [
            (side, start, stop)
            for side in range(2)
            for start, stop in stance_intervals(standing[:, side])
        ]
        starts = np.array([toes[start, side] for side, start, _ in runs]).reshape(-1, 3)
        normals = support_normals(source.scene.terrain, starts)
        heights_below = _support_heights(source.scene.terrain, starts, normals)
        for (side, start, stop), normal, below in zip(runs, normals, heights_below, strict=True):
            support[start:stop, side] = below
            part = np.s_[start:stop, side]
            pitch = _elevation(ankles[part] - toes[part], normal)
            flat[part] = (pitch >= _LEAST) & (pitch <= _MOST) & np.isfinite(below)
            flat[part] &= _elevation(knees[part] - ankles[part], normal) >= np.arcsin(_SHIN)
            heights = toes[start:stop, side, 2]
            rise[start:stop, side] = heights - np.minimum.accumulate(heights)
            x = np.array([normal[2], 0.0, -normal[0]]) / np.hypot(normal[0], normal[2])
            axes[start:stop, side] = x, np.cross(normal, x)
        return cls(source.pivots(standing), rise, axes, support, flat)


def support_normals(terrain: Terrain | None, points: np.ndarray) -> np.ndarray:
    """(P, 3) unit normals of terrain and ground under (P, 3) points, vertical at edges."""
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    if terrain is None or not len(points):
        return normals
    around = np.array([[_AROUND, 0, _ABOVE], [-_AROUND, 0, _ABOVE], [0, _AROUND, _ABOVE]])
    around = np.concatenate([around, [[0, -_AROUND, _ABOVE]]])
    probes = (points[:, None] + around).reshape(-1, 3)
    closest, distance = _closest(terrain, probes)
    level = (distance < 1e-4) | (distance > _NEAR) | (distance >= probes[:, 2])
    with np.errstate(invalid="ignore"):
        up = np.where(level[:, None], (0.0, 0.0, 1.0), (probes - closest) / distance[:, None])
    up = up.reshape(len(points), -1, 3)
    mean = up.mean(axis=1)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
    same = np.einsum("pkd,pd->pk", up, mean).min(axis=1) >= np.cos(_FLAT)
    known = same & (mean[:, 2] > _STEEP)
    normals[known] = mean[known]
    return normals


def _elevation(vectors: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(F,) angle of (F, 3) vectors above the plane with this normal, rad."""
    length = np.maximum(np.linalg.norm(vectors, axis=1), 1e-9)
    return np.arcsin(np.clip(vectors @ normal / length, -1.0, 1.0))


def _support_heights(
    terrain: Terrain | None, points: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """(P,) heights along (P, 3) normals of terrain or ground near (P, 3) points, else infinite."""
    closest, distance = points * (1.0, 1.0, 0.0), np.abs(points[:, 2])
    if terrain is not None and len(points):
        found, gap = _closest(terrain, points)
        closest = np.where((gap < distance)[:, None], found, closest)
        distance = np.minimum(distance, gap)
    heights = np.einsum("pd,pd->p", closest, normals)
    return np.where(distance <= _NEAR, heights, np.inf)


def _closest(terrain: Terrain, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(P, 3) points of the terrain closest to (P, 3) points, and (P,) their distances, m."""
    closest, distance = closest_points(terrain.parts, points)
    if terrain.heightfield is None:
        return closest, distance
    found, gap = terrain.heightfield.closest_points(points)
    return np.where((gap < distance)[:, None], found, closest), np.minimum(distance, gap)
