"""Where planted feet stand: footholds chosen before the clip is solved.

Anchoring a foot where it happens to be when a stance begins puts it in the wrong place: the human's
foot still settles. A foothold in the middle of where the foot would like to be over the whole
interval costs a tenth of the deformation energy. So a coarse pass without stance finds the wishes,
and the plan keeps

* the toe tip of an *anchored* foot in one place, and by ``StanceLimit`` the whole sole, but while
  the human rolls or turns the foot on its toes and the robot would have to do so far;
* the toe tip of a *loose* foot below a speed;
* soles beside each other;
* consecutive footholds within reach of each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import daqp
import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.foot_room import make_room
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.options import StanceOptions

FREE, LOOSE, ANCHORED = 0, 1, 2
"""Tiers of a foot in a frame."""

LIFT = 2e-3
"""How far a standing foot may lift off, m."""

# Speeds by which a free foot may be asked to leave its way for the next foothold.
_DETOUR = 0.6  # m/s
_FUNNEL = 0.15  # m: no window wider than this
_FLAT = 3e-3  # m: a stance whose arm from tip to heart changes less, seen from above, does not roll
# An upright foot that would turn (rad) or roll (change of the arm from above, in lengths of the
# sole) by more than this while it stands does so while the human's foot pivots, the toe tip in its
# place: to stand flat and still would contort the robot (bear crawl up a slope: a quarter more
# energy, three times its maximum). A foot that lies on its side or back, as in a crawl, has no
# weight on its sole and is held whole at little cost. A foot that comes down from its toes to stand
# flat, as of one who gets up from the knees, rolls in any case.
_TURN, _ROLL = 1.5, 0.3
_UPRIGHT = 0.8  # least horizontal part of the unit axis to the left of an upright foot
_LYING = 0.9  # least horizontal part of the unit axis to the left with which a foot has a heading
_LEVEL = 0.05  # m: feet that stand on heights further apart do not meet
# Pull of the planned heading on a landing foot: frames before landing that feel it, and its weight.
_APPROACH, _PULL = 8, 50.0


@dataclass(frozen=True, eq=False)
class FootWishes:
    """Where the feet would be without stance.

    Attributes:
        tips: (T, 2, 2) horizontal place of the toe tips, m.
        headings: (T, 2) heading, rad, continuous.
        reach: (T, 2) horizontal distance from tip to heart of the sole along the heading, m;
            negative.
        lying: (T, 2) length of the horizontal part of the unit axis to the left.
        length: (2,) from toe tip to heart of the sole, m.
    """

    tips: np.ndarray
    headings: np.ndarray
    reach: np.ndarray
    lying: np.ndarray
    length: np.ndarray


@dataclass(frozen=True, eq=False)
class StancePlan:
    """Windows of the feet on every frame; of the current or, before it, the next interval.

    Attributes:
        tier: (T, 2) ``FREE``, ``LOOSE`` or ``ANCHORED``.
        turns: (T, 2) the foot turns on its toes: its heading is free.
        rolls: (T, 2) the foot rolls over its toes: its pitch is free.
        rise: (T, 2) how far the foot may be above its lowest place in this stance so far, m;
            infinite where the foot lies on its side or back.
        axes: (T, 2, 2, 3) unit vectors along which a standing foot must not move.
        tips: (T, 2, 2) horizontal place of the toe tip, m.
        tip_slack: (T, 2) half width of its window, infinite for none: the tolerance on the
            foothold, and before it what the foot can still go, m.
        tip_step: (T, 2) largest step of the toe tip since the previous frame, m, per axis.
        forward: (T, 2, 2) unit vector of the wished heading.
        arms: (T, 2, 2) wished components along ``forward`` of the arms to the heart and to the
            left, m.
        arm_weights: (T, 2, 2) weights of these wishes, 1/m².
    """

    tier: np.ndarray
    turns: np.ndarray
    rolls: np.ndarray
    rise: np.ndarray
    axes: np.ndarray
    tips: np.ndarray
    tip_slack: np.ndarray
    tip_step: np.ndarray
    forward: np.ndarray
    arms: np.ndarray
    arm_weights: np.ndarray


def foot_wishes(feet: np.ndarray) -> FootWishes:
    """Wishes of (T, 2, 3, 3) feet, as ``Kinematics.feet`` returns them."""
    length = np.linalg.norm(feet[:, :, 1], axis=-1).mean(axis=0)
    feet = feet[..., :2]
    left = feet[:, :, 2]
    headings = np.unwrap(np.arctan2(-left[..., 0], left[..., 1]), axis=0)
    forward = np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    reach = (feet[:, :, 1] * forward).sum(axis=2)
    lying = 10.0 * np.linalg.norm(left, axis=-1)
    return FootWishes(feet[:, :, 0], headings, reach, lying, length)


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
    tier: np.ndarray,
    wishes: FootWishes,
    width: float,
    human: HumanFeet,
    fps: float,
    options: StanceOptions,
) -> StancePlan:
    """Chooses footholds near the wishes and the windows that lead to them.

    Args:
        tier: (T, 2) tier of each foot on each frame.
        wishes: Where the feet would be without stance.
        width: Of the feet, m.
        human: What the human's feet do in these tiers.
        fps: Frames per second.
        options: Settings.
    """
    slow = options.loose_speed / fps / np.sqrt(2.0)  # half side of the square inside the circle
    both_slow = np.zeros(tier.shape, bool)
    both_slow[1:] = (tier[1:] >= LOOSE) & (tier[:-1] >= LOOSE)
    pace = np.abs(np.diff(wishes.tips, axis=0, prepend=wishes.tips[:1])).max(axis=2)
    tip_step = np.where(both_slow, slow, pace + _DETOUR / fps)
    detour = np.where(both_slow, slow, _DETOUR / fps)
    tips, headings = wishes.tips.copy(), wishes.headings.copy()
    tip_slack = np.full(tier.shape, np.inf)
    arms, arm_weights = np.zeros((*tier.shape, 2)), np.zeros((*tier.shape, 2))
    turns, rolls = np.zeros(tier.shape, bool), np.zeros(tier.shape, bool)
    rise = np.full(tier.shape, np.inf)
    stances = [_runs(tier[:, foot] == ANCHORED) for foot in range(2)]
    middles = _middles(stances, wishes, width, human)
    for foot, runs in enumerate(stances):
        if not runs:
            continue
        for axis in range(2):
            holds = _footholds(runs, middles[foot][:, axis], tip_step[:, foot])
            tips[:, foot, axis] = _look_ahead(runs, holds, len(tier))
        tip_slack[:, foot] = _funnel(runs, detour[:, foot], options.tolerance)
        for start, end in runs:
            wish, reach = wishes.headings[start:end, foot], wishes.reach[start:end, foot]
            lying = wishes.lying[start:end, foot].min()
            rise[start:end, foot] = human.rise[start:end, foot] if lying >= _UPRIGHT else np.inf
            pivots = human.pivots[start:end, foot] & (lying >= _UPRIGHT)
            turning, rolling = np.ptp(wish) > _TURN, np.ptp(reach) > _ROLL * wishes.length[foot]
            flat = human.flat[start:end, foot]
            settled = np.logical_or.accumulate(flat & ~pivots)
            comes_down = flat.any() & ~settled
            turns[start:end, foot] = pivots & turning
            rolls[start:end, foot] = pivots & (rolling | comes_down)
            if lying < _LYING:
                continue
            first, turned, rolled = (
                max(start - _APPROACH, 0),
                _first(turns[start:end, foot]),
                _first(rolls[start:end, foot]),
            )
            headings[first : start + turned, foot] = wish[: max(turned, 1)].mean()
            arm_weights[first : start + turned, foot, 1] = _PULL
            if np.ptp(reach[: max(rolled, 1)]) <= _FLAT:
                arms[first : start + rolled, foot, 0] = np.median(reach[: max(rolled, 1)])
                arm_weights[first + _APPROACH // 2 : start + rolled, foot, 0] = _PULL
    forward = np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    return StancePlan(
        tier=tier,
        turns=turns,
        rolls=rolls,
        rise=rise,
        axes=human.axes,
        tips=tips,
        tip_slack=tip_slack,
        tip_step=tip_step,
        forward=forward,
        arms=arms,
        arm_weights=arm_weights,
    )


def _first(mask: np.ndarray) -> int:
    """Index of the first True, the length where there is none."""
    return int(np.argmax(mask)) if mask.any() else len(mask)


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """[start, end) of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _middles(
    stances: list[list[tuple[int, int]]], wishes: FootWishes, width: float, human: HumanFeet
) -> list[np.ndarray]:
    """(runs, 2) wished toe tip of every interval of either foot, with room for both soles."""
    runs = [(foot, start, end) for foot in range(2) for start, end in stances[foot]]
    tips = np.array([wishes.tips[start:end, foot].mean(axis=0) for foot, start, end in runs])
    headings = [np.median(wishes.headings[start:end, foot]) for foot, start, end in runs]
    upright = [wishes.lying[start:end, foot].min() >= _UPRIGHT for foot, start, end in runs]
    heights = [human.support[start, foot] for foot, start, _ in runs]
    second = len(stances[0])  # where the right foot's begin
    pairs = [
        (i, second + j)
        for i, j in _overlaps(*stances)
        if upright[i]
        and upright[second + j]
        and np.isclose(heights[i], heights[second + j], rtol=0.0, atol=_LEVEL)
    ]
    lengths = np.array([2.0 * wishes.length[foot] for foot, *_ in runs])
    tips = make_room(tips.reshape(-1, 2), np.array(headings), lengths, width, pairs)
    return np.split(tips, [second])


def _overlaps(
    first: list[tuple[int, int]], second: list[tuple[int, int]]
) -> Iterator[tuple[int, int]]:
    """Numbers of all intervals of two ascending lists that have a frame in common."""
    begin = 0
    for i, (start, end) in enumerate(first):
        while begin < len(second) and second[begin][1] <= start:
            begin += 1
        for j in range(begin, len(second)):
            if second[j][0] >= end:
                break
            yield i, j


def _footholds(runs: list[tuple[int, int]], wish: np.ndarray, step: np.ndarray) -> np.ndarray:
    """(runs,) foothold of every interval, for one coordinate.

    minimise Σ_i n_i (F_i - wish_i)² subject to |F_{i+1} - F_i| ≤ the steps between them.

    Args:
        runs: Intervals of constant coordinate.
        wish: (runs,) wished coordinate.
        step: (T,) largest change from the frame before.
    """
    gaps = itertools.pairwise(runs)
    reach = np.array([step[before[1] : after[0] + 1].sum() for before, after in gaps])
    if (np.abs(np.diff(wish)) <= reach).all():
        return wish
    count = np.array([end - start for start, end in runs], float)
    eye = np.eye(len(runs))
    sense = np.zeros(len(reach), np.intc)
    holds, _, _, _ = daqp.solve(
        np.diag(count), -count * wish, eye[1:] - eye[:-1], reach, -reach, sense
    )
    return holds


def _look_ahead(runs: list[tuple[int, int]], values: np.ndarray, frames: int) -> np.ndarray:
    """(T,) the value of the current or the next run; after the last run, its own."""
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
