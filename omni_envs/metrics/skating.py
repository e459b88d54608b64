"""What planted feet do: slip, and drift away from where they were planted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from omni_envs.metrics.playback import TARGETS, Playback
from omni_envs.robots import SIDES
from omni_envs.scenes import GROUND, TERRAIN

# A foot closer than this (m) to ground or terrain has that surface's normal; steeper ones are
# walls.
_SUPPORT_DISTANCE, _SUPPORT_SLOPE = 0.02, 0.5


def support_normals(playback: Playback) -> np.ndarray:
    """Returns the (T, 2, 3) unit normal of what each foot stands on, vertical off the ground.

    Of all contacts of a foot the one that faces up most counts: a shin against a wall is no
    support.
    """
    normals = np.zeros((playback.num_frames, 2, 3))
    normals[..., 2] = 1.0
    ground = np.isin(playback.target, [TARGETS.index(GROUND), TARGETS.index(TERRAIN)])
    near = ground & (playback.distance <= _SUPPORT_DISTANCE)
    near &= playback.normal[:, 2] > _SUPPORT_SLOPE
    for side, name in enumerate(SIDES):
        pairs = np.flatnonzero(near & playback.bodies((playback.robot.feet[name].body,)))
        # Ascending slope: the flattest contact of a frame is written last.
        for pair in pairs[np.argsort(playback.normal[pairs, 2], kind="stable")]:
            normals[playback.frame[pair], side] = playback.normal[pair]
    return normals


def counted_stance(stance: np.ndarray) -> np.ndarray:
    """Returns the (T, 2) foot-frames that count: planted, and planted on the frame before."""
    counted = np.zeros_like(stance, dtype=bool)
    counted[1:] = stance[1:] & stance[:-1]
    return counted


def slip_speed(soles: np.ndarray, normals: np.ndarray, fps: float) -> np.ndarray:
    """Speed of the slowest sole point tangent to the support: rolling is not slip.

    Args:
        soles: (T, 2, K, 3) sole points, m.
        normals: (T, 2, 3) support normals.
        fps: Frames per second.

    Returns:
        (T, 2) m/s since the previous frame, 0 on the first.
    """
    speed = np.zeros(soles.shape[:2])
    steps = _tangent(np.diff(soles, axis=0), normals[1:, :, None])
    speed[1:] = fps * np.linalg.norm(steps, axis=-1).min(axis=-1)
    return speed


def stance_drift(
    soles: np.ndarray, normals: np.ndarray, stance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How far a planted foot has moved since its stance began, tangent to the support.

    Args:
        soles: (T, 2, K, 3) sole points, the toe tip last, m.
        normals: (T, 2, 3) support normals.
        stance: (T, 2) bool.

    Returns:
        (T, 2) of the sole centre, the mean of all points but the toe tip; and (T, 2) of the point
        that moved least, which does not count rolling. Both m, NaN off stance.
    """
    centre, pivot = np.full(stance.shape, np.nan), np.full(stance.shape, np.nan)
    for side in range(stance.shape[1]):
        for start, end in intervals(stance[:, side]):
            feet = soles[start:end, side]
            moved = _tangent(feet - feet[0], normals[start:end, side, None])
            corners = moved[:, :-1] if moved.shape[1] > 1 else moved
            centre[start:end, side] = np.linalg.norm(corners.mean(axis=1), axis=-1)
            pivot[start:end, side] = np.linalg.norm(moved, axis=-1).min(axis=1)
    return centre, pivot


def intervals(flags: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yields (start, end) of every run of true flags, the end excluded."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    yield from ((int(a), int(b)) for a, b in edges.reshape(-1, 2))


def _tangent(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return vectors - np.sum(vectors * normals, axis=-1, keepdims=True) * normals
