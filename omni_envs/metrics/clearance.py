"""Whether the whole sole of a planted foot is down: a robot with short legs may stand on tiptoe."""

from __future__ import annotations

import numpy as np

from omni_envs.metrics.playback import REACH, TARGETS, Playback
from omni_envs.metrics.skating import SUPPORT_SLOPE, intervals
from omni_envs.robots import SIDES
from omni_envs.scenes import GROUND, TERRAIN

_SHORTEST = 0.1  # s


def sole_clearance(playback: Playback, normals: np.ndarray) -> np.ndarray:
    """Returns the (T, 2) height of the farthest sole point over what is below the foot, m.

    The gap below the foot and the height of its highest sole point over its lowest, along the
    normal of the support. A foot with nothing below it has a gap of ``REACH``.

    Args:
        playback: The motion.
        normals: (T, 2, 3) normals of the support.
    """
    heights = np.einsum("tskd,tsd->tsk", playback.soles(), normals)
    gaps = np.full(heights.shape[:2], REACH)
    below = np.isin(playback.target, [TARGETS.index(GROUND), TARGETS.index(TERRAIN)])
    below &= playback.normal[:, 2] > SUPPORT_SLOPE
    for side, name in enumerate(SIDES):
        pairs = below & playback.bodies((playback.robot.feet[name].body,))
        np.minimum.at(gaps[:, side], playback.frame[pairs], playback.distance[pairs])
    return np.maximum(gaps, 0.0) + np.ptp(heights, axis=2)


def stance_clearance(clearance: np.ndarray, flat: np.ndarray, fps: float) -> np.ndarray:
    """The usual clearance of every stance in which the human's foot is flat.

    Args:
        clearance: (T, 2) of the soles, m.
        flat: (T, 2) bool, the human stands on the whole sole.
        fps: Frames per second.

    Returns:
        (T, 2) median over the run of flat frames that a frame is in, m; NaN elsewhere and on runs
        shorter than 0.1 s.
    """
    usual = np.full(clearance.shape, np.nan)
    for side in range(clearance.shape[1]):
        for start, end in intervals(flat[:, side]):
            if end - start >= _SHORTEST * fps:
                usual[start:end, side] = np.median(clearance[start:end, side])
    return usual
