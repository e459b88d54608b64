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


@dataclass(frozen=True, eq=False)
class HumanFeet:
    """Standing human feet at robot scale.

    Attributes:
        pivots: (T, 2) bool, they roll or turn on their toes: see ``pivot_schedule``.
        rise: (T, 2) height of the toes above their lowest place in this stance so far, m.
        axes: (T, 2, 2, 3) world x and y as unit vectors laid into the surface that each foot came
            to stand on: along these a standing foot must not move.
    """

    pivots: np.ndarray
    rise: np.ndarray
    axes: np.ndarray

    @classmethod
    def of(cls, source: SourceMotion, standing: np.ndarray) -> HumanFeet:
        """Takes from a source what its feet do in a (T, 2) schedule."""
        toes = source.keypoints[:, [KEYPOINTS.index(f"{side}_toe") for side in SIDES]]
        rise, axes = np.zeros(standing.shape), np.tile(np.eye(3)[:2], (*standing.shape, 1, 1))
        runs = [
            (side, start, stop)
            for side in range(2)
            for start, stop in stance_intervals(standing[:, side])
        ]
        starts = np.array([toes[start, side] for side, start, _ in runs]).reshape(-1, 3)
        normals = support_normals(source.scene.terrain, starts)
        for (side, start, stop), normal in zip(runs, normals, strict=True):
            heights = toes[start:stop, side, 2]
            rise[start:stop, side] = heights - np.minimum.accumulate(heights)
            x = np.array([normal[2], 0.0, -normal[0]]) / np.hypot(normal[0], normal[2])
            axes[start:stop, side] = x, np.cross(normal, x)
        return cls(source.pivots(standing), rise, axes)


def support_normals(terrain: Terrain | None, points: np.ndarray) -> np.ndarray:
    """(P, 3) unit normals of terrain and ground under (P, 3) points, vertical at edges."""
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    if terrain is None or not len(points):
        return normals
    around = np.array([[_AROUND, 0, _ABOVE], [-_AROUND, 0, _ABOVE], [0, _AROUND, _ABOVE]])
    around = np.concatenate([around, [[0, -_AROUND, _ABOVE]]])
    probes = (points[:, None] + around).reshape(-1, 3)
    closest, distance = closest_points(terrain.parts, probes)
    if terrain.heightfield is not None:
        found, gap = terrain.heightfield.closest_points(probes)
        closest = np.where((gap < distance)[:, None], found, closest)
        distance = np.minimum(distance, gap)
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
