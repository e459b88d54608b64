"""Where planted feet stand: footholds chosen before the clip is solved.

Anchoring a foot where it happens to be when a stance begins puts it in the wrong place: the human's foot
still settles. A foothold in the middle of where the foot would like to be over the whole interval costs a
tenth of the deformation energy. So a coarse pass without stance finds the wishes, and the plan keeps

* the toe tip of an *anchored* foot in one place, and ``StanceLimit`` its heading: the foot may roll over its
  toes, but not slide or turn;
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

_DETOUR = 0.6  # m/s by which a free foot may be asked to leave its way for the next foothold
_FUNNEL = 0.15  # m: no window wider than this


@dataclass(frozen=True, eq=False)
class StancePlan:
    """Where the toe tips should be.

    Attributes:
        tier: (T, 2) ``FREE``, ``LOOSE`` or ``ANCHORED``.
        footholds: (T, 2, 2) horizontal place of the current or the next foothold of each toe tip, m.
        slack: (T, 2) half width of the window about it, m, infinite for none: ``tolerance`` on the foothold,
            and before it what the foot can still go.
        step: (T, 2) largest step of each toe tip since the previous frame, m, per axis.
    """

    tier: np.ndarray
    footholds: np.ndarray
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
        wishes: (T, 2, 2) horizontal places where the toe tips would be without stance, m.
        fps: Frames per second.
        options: Settings.
    """
    footholds, slack = wishes.copy(), np.full(tier.shape, np.inf)
    slow = options.loose_speed / fps / np.sqrt(2.0)  # half side of the square inside the circle
    both_slow = np.zeros(tier.shape, bool)
    both_slow[1:] = (tier[1:] >= LOOSE) & (tier[:-1] >= LOOSE)
    swing = np.abs(np.diff(wishes, axis=0, prepend=wishes[:1])).max(axis=2) + _DETOUR / fps
    step = np.where(both_slow, slow, swing)
    for foot in range(2):
        runs = _runs(tier[:, foot] == ANCHORED)
        if not runs:
            continue
        for axis in range(2):
            footholds[:, foot, axis] = _footholds(runs, wishes[:, foot, axis], step[:, foot])
        detour = np.where(both_slow[:, foot], slow, _DETOUR / fps)
        slack[:, foot] = _funnel(runs, detour, options.tolerance)
    return StancePlan(tier, footholds, slack, step)


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """[start, end) of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _footholds(runs: list[tuple[int, int]], wish: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """(T,) the foothold of the current or the next interval, for one coordinate.

    minimise Σ_i n_i (F_i - mean of the wishes)² subject to |F_{i+1} - F_i| ≤ reach between them.

    Args:
        runs: Intervals of constant coordinate.
        wish: (T,) wished coordinate.
        reach: (T,) largest change from the frame before.
    """
    count = np.array([end - start for start, end in runs], float)
    mean = np.array([wish[start:end].mean() for start, end in runs])
    between = np.array(
        [
            reach[b[0] : b[0] + 1].sum() + reach[a[1] : b[0]].sum()
            for a, b in zip(runs, runs[1:], strict=False)
        ]
    )
    holds = mean
    if len(runs) > 1 and (np.abs(np.diff(mean)) > between).any():
        n = len(runs)
        difference = np.eye(n)[1:] - np.eye(n)[:-1]
        solution, _, flag, _ = daqp.solve(
            np.diag(count),
            -count * mean,
            difference,
            between,
            -between,
            np.zeros(n - 1, np.intc),
        )
        holds = solution if flag > 0 else mean
    # Every frame looks ahead to the next interval; frames after the last one keep its foothold.
    plan = np.empty(len(wish))
    start = 0
    for (_, end), hold in zip(runs, holds, strict=True):
        plan[start:end] = hold
        start = end
    plan[start:] = holds[-1]
    return plan


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
