"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows
from omni_envs.retargeting.stance_plan import ANCHORED, FREE, StancePlan

_ARM = 0.1  # m: the heading tolerance moves the heel about as far as the tip's tolerance the tip


class StanceLimit(RowLimit):
    """Windows of toe tip and heading of both feet on the current frame of a plan.

    An anchored foot keeps its **absolute** place: a window about the previous frame, as in the official
    code, lets the foot creep. Tip and heading hold the whole foot but for rolling over the toes, which is
    not slip; non-penetration holds the rest of the sole above the ground.

    Args:
        plan: Where the feet should be.
        tolerance: Half width of the anchor window of a toe tip, m.
    """

    def __init__(self, plan: StancePlan, tolerance: float) -> None:
        self._plan = plan
        self._tolerance = tolerance
        self._anchors, self._lateral = np.zeros((2, 2)), np.zeros((2, 2))
        self.release()

    def release(self) -> None:
        """Frees both feet."""
        self._held = self._turning = np.zeros(0, int)

    def hold(self, t: int) -> None:
        """Chooses frame t of the plan. ``record`` must have been called on frame t - 1."""
        plan = self._plan
        slack = plan.slack[t][:, None]
        lower, upper = plan.footholds[t] - slack, plan.footholds[t] + slack
        stays = self._stays(t)
        if t > 0:
            # Nowhere further than a step from the frame before, even if that misses the foothold.
            step = plan.step[t][:, None]
            np.clip(lower, self._anchors - step, self._anchors + step, out=lower)
            np.clip(upper, self._anchors - step, self._anchors + step, out=upper)
            free = (plan.tier[t] == FREE) & ~np.isfinite(plan.slack[t])
            lower[free], upper[free] = -np.inf, np.inf
            lower[stays] = self._anchors[stays] - self._tolerance
            upper[stays] = self._anchors[stays] + self._tolerance
        self._held = np.flatnonzero(np.isfinite(lower[:, 0]))
        self._lower, self._upper = lower[self._held].ravel(), upper[self._held].ravel()
        self._turning = np.flatnonzero(stays)
        left = self._lateral[self._turning]
        self._forward = np.stack([left[:, 1], -left[:, 0]], axis=-1)

    def record(self, configuration: Kinematics, t: int) -> None:
        """Remembers where frame t has put the feet, except those that it held in their place."""
        moved = ~self._stays(t)
        tips, lateral = configuration.feet()
        self._anchors[moved], self._lateral[moved] = tips[moved, :2], lateral[moved, :2]

    def _stays(self, t: int) -> np.ndarray:
        """(2,) whether each foot keeps the place of the frame before."""
        tier = self._plan.tier
        return (tier[t] == ANCHORED) & (tier[t - 1] == ANCHORED) if t > 0 else np.zeros(2, bool)

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows for a held tip and one for a held heading."""
        if not len(self._held):
            return None
        tips, lateral = configuration.feet()
        jacobian = configuration.feet_jacobians(tips, lateral)
        place = tips[self._held, :2].ravel()
        # The lateral axis keeps a zero component along the heading.
        turn = (self._forward * lateral[self._turning, :2]).sum(axis=1)
        slack = self._tolerance / _ARM
        A = np.concatenate(
            [
                jacobian[self._held, 0].reshape(-1, jacobian.shape[-1]),
                (self._forward[:, :, None] * jacobian[self._turning, 1]).sum(axis=1),
            ]
        )
        lower = np.concatenate([self._lower - place, -slack - turn])
        upper = np.concatenate([self._upper - place, slack - turn])
        return Rows(A, lower, upper, np.full(len(lower), STANCE))
