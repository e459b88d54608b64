"""Where planted feet stand: footholds chosen before the clip is solved.

Anchoring a foot where it happens to be when a stance begins puts it in the wrong place: the human's foot
still settles. A foothold in the middle of where the foot would like to be over the whole interval costs a
tenth of the deformation energy. So a coarse pass without stance finds the wishes, and the plan keeps

* the toe tip of an *anchored* foot in one place, and the heart of its sole beside it: the foot may roll over
  its toes, but not slide or turn; where the wish hardly rolls, neither does the plan;
* the toe tip of a *loose* foot below a speed;
* consecutive footholds within reach of each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.options import StanceOptions

FREE, LOOSE, ANCHORED = 0, 1, 2
"""Tiers of a foot in a frame."""

TIP, HEART = 0, 1
"""Held points of a foot."""

_DETOUR = 0.6  # m/s by which a free foot may be asked to leave its way for the next foothold
_FUNNEL = 0.15  # m: no window wider than this
_FLAT = 3e-3  # m: a stance whose arm from tip to heart changes less, seen from above, does not roll
_UPRIGHT = 0.03  # m: a foot with a shorter arm stands on its toes and has no heading


@dataclass(frozen=True, eq=False)
class StancePlan:
    """Where toe tip and heart of both feet should be.

    Windows of the heart are along and across the foot, those of the tip along x and y.

    Attributes:
        tier: (T, 2) ``FREE``, ``LOOSE`` or ``ANCHORED``.
        footholds: (T, 2, 2, 2) horizontal place of tip and heart of each foot in the current or the next
            interval, m.
        axes: (T, 2, 2, 2, 2) axes of the windows: foot; tip or heart; axis; x and y of the axis.
        slack: (T, 2, 2, 2) half width of the windows, m, infinite for none: the tolerance on the foothold,
            and before it what the foot can still go.
        step: (T, 2, 2) largest step of each point since the previous frame, m, per axis.
    """

    tier: np.ndarray
    footholds: np.ndarray
    axes: np.ndarray
    slack: np.ndarray
    step: np.ndarray


def stance_tiers(source: SourceMotion, options: StanceOptions) -> np.ndarray:
    """(T, 2) tier of each foot on each frame."""
    tiers = np.full((source.num_frames, 2), FREE)
    if options.loose is not None:
        tiers[source.stance[options.loose]] = LOOSE
    if options.anchored is not None:
        # Wider sets drop very short intervals, so that they need not contain the strict set.
        tiers[source.stance["text"] | source.stance[options.anchored]] = ANCHORED
    return tiers


def plan_stance(
    tier: np.ndarray, wishes: np.ndarray, fps: float, options: StanceOptions
) -> StancePlan:
    """Chooses footholds near the wishes and the windows that lead to them.

    Args:
        tier: (T, 2) tier of each foot on each frame.
        wishes: (T, 2, 2, 2) horizontal places of tip and heart of each foot without stance, m.
        fps: Frames per second.
        options: Settings.
    """
    footholds, slack = wishes.copy(), np.full(wishes.shape, np.inf)
    axes = np.broadcast_to(np.eye(2), (*wishes.shape, 2)).copy()
    slow = options.loose_speed / fps / np.sqrt(2.0)  # half side of the square inside the circle
    both_slow = np.zeros(tier.shape, bool)
    both_slow[1:] = (tier[1:] >= LOOSE) & (tier[:-1] >= LOOSE)
    step = np.abs(np.diff(wishes, axis=0, prepend=wishes[:1])).max(axis=3) + _DETOUR / fps
    step[:, :, TIP][both_slow] = slow
    detour = np.full(len(tier), _DETOUR / fps)
    for foot in range(2):
        runs = _runs(tier[:, foot] == ANCHORED)
        if not runs:
            continue
        for axis in range(2):
            footholds[:, foot, TIP, axis] = _footholds(
                runs, wishes[:, foot, TIP, axis], step[:, foot, TIP]
            )
        arm = wishes[:, foot, HEART] - wishes[:, foot, TIP]
        planned, length, change = _typical_arm(runs, arm)
        footholds[:, foot, HEART] = footholds[:, foot, TIP] + planned
        along = planned / np.maximum(length, 1e-9)[:, None]
        axes[:, foot, HEART] = np.stack([along, along[:, ::-1] * [-1.0, 1.0]], axis=1)
        to_tip = np.where(both_slow[:, foot], slow, detour)
        slack[:, foot, TIP] = _funnel(runs, to_tip, options.tolerance)[:, None]
        slack[:, foot, HEART] = _funnel(runs, detour, options.roll)[:, None]
        slack[change > _FLAT, foot, HEART, 0] = np.inf
        slack[length < _UPRIGHT, foot, HEART] = np.inf
    return StancePlan(tier, footholds, axes, slack, step)


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """[start, end) of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _footholds(runs: list[tuple[int, int]], wish: np.ndarray, step: np.ndarray) -> np.ndarray:
    """(T,) the foothold of the current or the next interval, for one coordinate.

    minimise Σ_i n_i (F_i - mean of the wishes)² subject to |F_{i+1} - F_i| ≤ the steps between them.

    Args:
        runs: Intervals of constant coordinate.
        wish: (T,) wished coordinate.
        step: (T,) largest change from the frame before.
    """
    count = np.array([end - start for start, end in runs], float)
    holds = np.array([wish[start:end].mean() for start, end in runs])
    gaps = zip(runs[:-1], runs[1:], strict=True)
    reach = np.array([step[before[1] : after[0] + 1].sum() for before, after in gaps])
    if (np.abs(np.diff(holds)) > reach).any():
        eye = np.eye(len(runs))
        sense = np.zeros(len(reach), np.intc)
        holds, _, _, _ = daqp.solve(
            np.diag(count), -count * holds, eye[1:] - eye[:-1], reach, -reach, sense
        )
    return _look_ahead(runs, holds, len(wish))


def _typical_arm(
    runs: list[tuple[int, int]], arm: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From tip to heart in the current or the next interval.

    Returns:
        (T, 2) arm of mean direction and median length, (T,) its length, (T,) range of lengths.
    """
    length = np.linalg.norm(arm, axis=1)
    mean = np.array([arm[start:end].mean(axis=0) for start, end in runs])
    median = np.array([np.median(length[start:end]) for start, end in runs])
    change = np.array([np.ptp(length[start:end]) for start, end in runs])
    direction = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-9)
    parts = (direction * median[:, None], median, change)
    planned, size, spread = (_look_ahead(runs, part, len(arm)) for part in parts)
    return planned, size, spread


def _look_ahead(runs: list[tuple[int, int]], values: np.ndarray, frames: int) -> np.ndarray:
    """(T, …) the value of the current or the next run; after the last run, its own."""
    following = np.searchsorted([end for _, end in runs], np.arange(frames), side="right")
    return values[np.minimum(following, len(runs) - 1)]


def _funnel(runs: list[tuple[int, int]], detour: np.ndarray, tolerance: float) -> np.ndarray:
    """(T,) half width of the window: ``tolerance`` on an interval, wider the longer before it."""
    slack = np.full(len(detour), np.inf)
    for start, end in runs:
        slack[start:end] = tolerance
        left = tolerance
        for t in range(start - 1, -1, -1):
            left += detour[t + 1]
            if left > _FUNNEL or np.isfinite(slack[t]):
                break
            slack[t] = left
    return slack
