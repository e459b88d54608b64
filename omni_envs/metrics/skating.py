"""What planted feet do: slip, and drift away from where they were planted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from omni_envs.metrics.playback import TARGETS, Playback
from omni_envs.robots import SIDES
from omni_envs.scenes import GROUND, TERRAIN

# A foot closer than this (m) to ground or terrain has that surface's normal; steeper ones are
# walls.
_SUPPORT_DISTANCE, SUPPORT_SLOPE = 0.02, 0.5


def support_normals(playback: Playback) -> np.ndarray:
    """Returns the (T, 2, 3) unit normal of what each foot stands on, vertical off the ground.

    Of all contacts of a foot the one that faces up most counts: a shin against a wall is no
    support.
    """
    normals = np.zeros((playback.num_frames, 2, 3))
    normals[..., 2] = 1.0
    ground = np.isin(playback.target, [TARGETS.index(GROUND), TARGETS.index(TERRAIN)])
    near = ground & (playback.distance <= _SUPPORT_DISTANCE)
    near &= playback.normal[:, 2] > SUPPORT_SLOPE
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
    soles: np.ndarray, normals: np.ndarray, stance: np.ndarray, pivots: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far a planted foot has moved since its stance began, tangent to the support.

    A stance is where the toe stays. Within it the human may roll from the flat foot onto the toes,
    as at the end of every long step and all the time in a bear crawl; the centre of a sole that
    rolls along leaves its place by up to its length, though nothing slides. Therefore three
    figures: the strict one, which counts that; one of the parts in which the human's foot keeps its
    direction, where the whole sole shall stay; and one of the pivot, which shall stay throughout.
    The parts are those of the source (``SourceMotion.pivots``), so a robot that rolls where the
    human does not is not excused.

    Args:
        soles: (T, 2, K, 3) sole points, the toe tip last, m.
        normals: (T, 2, 3) support normals.
        stance: (T, 2) bool.
        pivots: (T, 2) bool, the human's foot rolls or turns on its toes.

    Returns:
        (T, 2) of the sole centre, the mean of all points but the toe tip; (T, 2) of the same while
        the human's foot does not pivot, from where it was when the stance began or from where the
        last pivoting left it, whichever is nearer; and (T, 2) of the point that moved least since
        the stance began. All m, NaN off stance.
    """
    centre, still, pivot = np.full((3, *stance.shape), np.nan)
    for side in range(stance.shape[1]):
        for start, end in intervals(stance[:, side]):
            moved = _moved(soles[start:end, side], normals[start:end, side])
            centre[start:end, side] = _of_centre(moved)
            pivot[start:end, side] = np.linalg.norm(moved, axis=-1).min(axis=1)
        for start, end in intervals(stance[:, side] & ~pivots[:, side]):
            moved = _moved(soles[start:end, side], normals[start:end, side])
            still[start:end, side] = np.minimum(_of_centre(moved), centre[start:end, side])
    return centre, still, pivot


def _moved(sole: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(F, K, 3) displacement of (F, K, 3) points since the first frame, tangent to the support."""
    return _tangent(sole - sole[0], normals[:, None])


def _of_centre(moved: np.ndarray) -> np.ndarray:
    """(F,) displacement of the sole centre."""
    corners = moved[:, :-1] if moved.shape[1] > 1 else moved
    return np.linalg.norm(corners.mean(axis=1), axis=-1)


def intervals(flags: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yields (start, end) of every run of true flags, the end excluded."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    yield from ((int(a), int(b)) for a, b in edges.reshape(-1, 2))


def _tangent(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return vectors - np.sum(vectors * normals, axis=-1, keepdims=True) * normals
