"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows
from omni_envs.retargeting.stance_plan import ANCHORED, LOOSE, StancePlan

TIP, LEFT = 0, 2
"""Rows of ``Kinematics.feet``: the toe tip, and the arm from there to the left."""


class StanceLimit(RowLimit):
    """Windows of both feet on the current frame of a plan.

    An anchored foot keeps its **absolute** place and heading: a window about the previous frame, as in the
    official code, lets the foot creep. It may roll over its toes, which is not slip, and turn on them where
    the human does; non-penetration holds the rest of the sole above the ground.

    Args:
        plan: Where the feet should be.
        tolerance: Half width of the window of the heading, as way of a point 0.1 m from the tip, m.
    """

    def __init__(self, plan: StancePlan, tolerance: float) -> None:
        self._plan = plan
        self._tolerance = tolerance
        self._tips, self._forward = np.zeros((2, 2)), np.zeros((2, 2))

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
        self._staying = np.flatnonzero(stays & ~plan.pivots[t])

    def record(self, configuration: Kinematics, t: int) -> None:
        """Remembers where frame t has put the feet, except those that it held in their place."""
        plan, feet = self._plan, configuration.feet()[:, :, :2]
        # A tip that has reached its foothold keeps that, so that its window does not wander.
        missed = np.abs(feet[:, TIP] - plan.tips[t]).max(axis=1)
        reached = (plan.tier[t] == ANCHORED) & (missed <= plan.tip_slack[t] + 1e-4)
        moved = ~self._stays(t)
        self._tips[moved] = np.where(reached[:, None], plan.tips[t], feet[:, TIP])[moved]
        self._forward[moved] = feet[moved, LEFT, ::-1] * [1.0, -1.0]
        self._forward /= np.linalg.norm(self._forward, axis=1, keepdims=True)

    def _stays(self, t: int) -> np.ndarray:
        """(2,) whether each foot keeps the place of the frame before."""
        tier = self._plan.tier
        return (tier[t] == ANCHORED) & (tier[t - 1] == ANCHORED) if t > 0 else np.zeros(2, bool)

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows for a held toe tip and one for a held heading."""
        if not (len(self._held) or len(self._staying)):
            return None
        feet = configuration.feet()
        jacobian = configuration.feet_jacobians(feet)
        # The arm to the left keeps no component along the heading.
        forward = self._forward[self._staying]
        turned = (feet[self._staying, LEFT, :2] * forward).sum(axis=1)
        tips = feet[self._held, TIP, :2]
        A = np.concatenate(
            [
                jacobian[self._held, TIP].reshape(-1, jacobian.shape[-1]),
                (jacobian[self._staying, LEFT] * forward[:, :, None]).sum(axis=1),
            ]
        )
        lower = np.concatenate([(self._low - tips).ravel(), -self._tolerance - turned])
        upper = np.concatenate([(self._high - tips).ravel(), self._tolerance - turned])
        return Rows(A, lower, upper, np.full(len(lower), STANCE))
