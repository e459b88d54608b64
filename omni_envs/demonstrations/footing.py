"""Putting a recorded person on the ground.

A toe joint is not the sole: it stands 1 to 5 cm above the ground, more in one foot than in the
other, and more on one step than on the next where markers slip. One height for the whole clip, such
as that of the lowest toe, leaves feet that float through every step but one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omni_envs.demonstrations.contact import KNEE_RADIUS
from omni_envs.demonstrations.stance import stance_intervals, stance_schedule

SAME_GROUND = 0.06  # m above the lowest footholds; what is higher stands on something, or is lifted
_STRAY = 1 / 3  # s for which knees may be deeper than the ground allows
_LOWEST = 0.1  # share of the standing time that is on the lowest footholds
_MAX_RISE = 0.15  # m/s; a foot that is lifted straight up does not stand
_MIN_FRAMES = 3


def stand_on_ground(
    positions: np.ndarray,
    toes: np.ndarray,
    knees: np.ndarray,
    feet: Sequence[Sequence[int]],
    fps: float,
) -> np.ndarray:
    """Lowers the body by the height at which its toes usually stand, and every step to z = 0.

    The body of someone on the knees is lowered as far as these allow (``knee_floor``). A foot
    moves as a whole and by one height through each of its steps, so it rolls as it did; in between
    the height changes linearly. Feet that stand more than ``SAME_GROUND`` above the lowest
    footholds keep their height over the body's: they are on something that was not recorded, or
    lifted. Where no foot ever stands, the lowest toe of the clip is put on the ground.

    Args:
        positions: (T, J, 3) joints, m, z up.
        toes: (T, 2, 3) toes of both feet.
        knees: (T, 2, 3) both knees.
        feet: For both feet the joints that move with the toe.
        fps: Frames per second.

    Returns:
        (T, J, 3) joints over ground at z = 0, toes not below it.
    """
    steps = [_steps(toes[:, foot], fps) for foot in range(2)]
    heights, frames = np.array([s[2:] for foot in steps for s in foot]).reshape(-1, 2).T
    grounded = np.array(positions)
    if not len(heights):
        grounded[..., 2] -= toes[..., 2].min()
        return grounded
    near = heights <= _quantile(heights, frames, _LOWEST) + SAME_GROUND
    usual = min(_quantile(heights[near], frames[near], 0.5), knee_floor(knees, fps))
    grounded[..., 2] -= usual
    for foot, joints in enumerate(feet):
        lower = np.zeros(len(positions))
        on_ground = [s for s in steps[foot] if s[2] <= heights[near].max()]
        if on_ground:
            times = [t for start, stop, *_ in on_ground for t in (start, stop - 1)]
            values = [height - usual for *_, height, _ in on_ground for _ in range(2)]
            lower = np.interp(np.arange(len(positions)), times, values)
        toe = toes[:, foot, 2] - usual - lower
        grounded[:, list(joints), 2] -= (lower + np.minimum(toe, 0.0))[:, None]
    return grounded


def knee_floor(knees: np.ndarray, fps: float) -> float:
    """The highest ground that knees allow, m.

    A knee comes no lower than its radius, but for a third of a second in all, which a stray frame
    may take.

    Args:
        knees: (T, 2, 3) both knees, m, human scale.
        fps: Frames per second.
    """
    lower = np.sort(knees[..., 2].min(axis=1))
    return float(lower[min(round(_STRAY * fps), len(lower) // 10)] - KNEE_RADIUS)


def _steps(toe: np.ndarray, fps: float) -> list[tuple[int, int, float, int]]:
    """When a foot stands: start, stop, median height of the toe (m), frames."""
    rise = np.abs(np.gradient(toe[:, 2])) * fps if len(toe) > 1 else np.zeros(len(toe))
    planted = stance_schedule(toe, fps) & (rise <= _MAX_RISE)
    return [
        (start, stop, float(np.median(toe[start:stop, 2])), stop - start)
        for start, stop in stance_intervals(planted)
        if stop - start >= _MIN_FRAMES
    ]


def _quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    order = np.argsort(values)
    reached = np.cumsum(weights[order]) >= share * weights.sum()
    return float(values[order][np.argmax(reached)])
