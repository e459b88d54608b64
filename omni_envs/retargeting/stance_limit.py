"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import ANCHORED, LOOSE, StancePlan

TIP, HEART, LEFT = 0, 1, 2
"""Rows of ``Kinematics.feet``: the toe tip, and the arms from there to heart and left."""
_AXES = np.eye(2)


class StanceLimit(RowLimit):
    """Windows of both feet on the current frame of a plan.

    An anchored foot keeps its **absolute** place: a window about the previous frame, as in the
    official code, lets the foot creep. Toe tip and heart hold the whole sole; where the plan rolls
    the foot over its toes or turns it on them, which is not slip, the heart is free to.
    Non-penetration holds the sole above the ground.

    Args:
        plan: Where the feet should be.
        options: Settings.
    """

    def __init__(self, plan: StancePlan, options: StanceOptions) -> None:
        self._plan, self._options = plan, options
        self._tips, self._arms, self._forward = np.zeros((3, 2, 2))

    def hold(self, t: int) -> None:
        """Chooses frame t of the plan. ``record`` must have been called on frame t - 1."""
        plan, stays = self._plan, self._stays(t)
        self._windows: list[tuple[np.ndarray, float, float]] = []
        tolerance = self._options.heart_tolerance
        for foot in range(2):
            slack, tip = plan.tip_slack[t, foot], self._tips[foot]
            centre = tip if stays[foot] else plan.tips[t, foot]
            low, high = centre - slack, centre + slack
            if t > 0 and not stays[foot]:
                # Nowhere further than a step from the frame before, even if that misses the
                # foothold.
                step = plan.tip_step[t, foot]
                low = np.minimum(np.maximum(low, tip - step), tip + step)
                high = np.minimum(np.maximum(high, tip - step), tip + step)
            if np.isfinite(low[0]) and (np.isfinite(slack) or plan.tier[t, foot] == LOOSE):
                for axis in range(2):
                    self._hold(foot, TIP, _AXES[axis], low[axis], high[axis])
            if not stays[foot] or plan.turns[t, foot]:
                continue
            if plan.rolls[t, foot]:
                # The arm to the left keeps no component along the heading.
                self._hold(foot, LEFT, self._forward[foot], -tolerance, tolerance)
                continue
            for axis in range(2):
                arm = self._arms[foot, axis]
                self._hold(foot, HEART, _AXES[axis], arm - tolerance, arm + tolerance)
        if self._windows:
            select, lower, upper = zip(*self._windows, strict=True)
            self._select, self._lower, self._upper = map(np.array, (select, lower, upper))
            self._kind = np.full(len(lower), STANCE)

    def _hold(self, foot: int, point: int, direction: np.ndarray, low: float, high: float) -> None:
        """Holds the component of a point of a foot along a direction within [low, high]."""
        select = np.zeros((2, 3, 2))
        select[foot, point] = direction
        self._windows.append((select.ravel(), low, high))

    def record(self, configuration: Kinematics, t: int) -> None:
        """Remembers where frame t has put the feet, except those that it held in their place."""
        plan, feet, stays = self._plan, configuration.feet()[:, :, :2], self._stays(t)
        for foot in range(2):
            if stays[foot]:
                continue
            # A tip that has reached its foothold keeps that, so that its window does not wander.
            tip, hold = feet[foot, TIP], plan.tips[t, foot]
            reached = plan.tier[t, foot] == ANCHORED and (
                np.abs(tip - hold).max() <= plan.tip_slack[t, foot] + 1e-4
            )
            self._tips[foot] = hold if reached else tip
            self._arms[foot] = feet[foot, HEART]
            x, y = feet[foot, LEFT]
            self._forward[foot] = np.array([y, -x]) / np.hypot(x, y)

    def _stays(self, t: int) -> np.ndarray:
        """(2,) whether each foot keeps the place of the frame before."""
        tier = self._plan.tier
        return (tier[t] == ANCHORED) & (tier[t - 1] == ANCHORED) if t > 0 else np.zeros(2, bool)

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows for a held toe tip, two for a flat foot and one for a rolling one."""
        if not self._windows:
            return None
        places = self._select @ configuration.feet()[:, :, :2].ravel()
        A = self._select @ configuration.feet_jacobians().reshape(12, -1)
        return Rows(A, self._lower - places, self._upper - places, self._kind)
