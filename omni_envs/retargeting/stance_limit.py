"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import ANCHORED, LOOSE, StancePlan

TIP, HEART, LEFT = 0, 1, 2
"""Rows of ``Kinematics.feet``: the toe tip, and the arms from there to heart and left."""


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
        slack = plan.tip_slack[t][:, None]
        centre = np.where(stays[:, None], self._tips, plan.tips[t])
        low, high = centre - slack, centre + slack
        if t > 0:
            # Nowhere further than a step from the frame before, even if that misses the foothold.
            step = np.where(stays, np.inf, plan.tip_step[t])[:, None]
            np.clip(low, self._tips - step, self._tips + step, out=low)
            np.clip(high, self._tips - step, self._tips + step, out=high)
        held = np.isfinite(plan.tip_slack[t]) | (plan.tier[t] == LOOSE)
        self._held = np.flatnonzero(held & np.isfinite(low[:, 0]))
        self._low, self._high = low[self._held], high[self._held]
        turns, rolls = plan.turns[t], plan.rolls[t]
        self._flat = np.flatnonzero(stays & ~turns & ~rolls)
        self._rolling = np.flatnonzero(stays & ~turns & rolls)

    def record(self, configuration: Kinematics, t: int) -> None:
        """Remembers where frame t has put the feet, except those that it held in their place."""
        plan, feet = self._plan, configuration.feet()[:, :, :2]
        # A tip that has reached its foothold keeps that, so that its window does not wander.
        missed = np.abs(feet[:, TIP] - plan.tips[t]).max(axis=1)
        reached = (plan.tier[t] == ANCHORED) & (missed <= plan.tip_slack[t] + 1e-4)
        moved = ~self._stays(t)
        self._tips[moved] = np.where(reached[:, None], plan.tips[t], feet[:, TIP])[moved]
        self._arms[moved] = feet[moved, HEART]
        left = feet[moved, LEFT]
        forward = left[:, ::-1] * [1.0, -1.0]
        self._forward[moved] = forward / np.linalg.norm(left, axis=1, keepdims=True)

    def _stays(self, t: int) -> np.ndarray:
        """(2,) whether each foot keeps the place of the frame before."""
        tier = self._plan.tier
        return (tier[t] == ANCHORED) & (tier[t - 1] == ANCHORED) if t > 0 else np.zeros(2, bool)

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows for a held toe tip, two for a flat foot and one for a rolling one."""
        if not len(self._held):
            return None
        feet = configuration.feet()
        jacobian = configuration.feet_jacobians()
        nv = jacobian.shape[-1]
        tips, arms = feet[self._held, TIP, :2], feet[self._flat, HEART, :2]
        # The arm to the left keeps no component along the heading.
        forward = self._forward[self._rolling]
        turned = (feet[self._rolling, LEFT, :2] * forward).sum(axis=1)
        A = np.concatenate(
            [
                jacobian[self._held, TIP].reshape(-1, nv),
                jacobian[self._flat, HEART].reshape(-1, nv),
                (jacobian[self._rolling, LEFT] * forward[:, :, None]).sum(axis=1),
            ]
        )
        arm = (self._arms[self._flat] - arms).ravel()
        centre = np.concatenate([np.zeros(tips.size), arm, -turned])
        slack = np.full(len(centre), self._options.heart_tolerance)
        lower, upper = centre - slack, centre + slack
        lower[: tips.size] = (self._low - tips).ravel()
        upper[: tips.size] = (self._high - tips).ravel()
        return Rows(A, lower, upper, np.full(len(lower), STANCE))
