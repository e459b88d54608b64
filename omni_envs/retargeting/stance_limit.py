"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows
from omni_envs.retargeting.stance_plan import ANCHORED, LOOSE, TIP, StancePlan


class StanceLimit(RowLimit):
    """Windows of toe tip and heart of both soles on the current frame of a plan.

    An anchored foot keeps its **absolute** place: a window about the previous frame, as in the official
    code, lets the foot creep. It may roll over its toes, which is not slip, where the plan does;
    non-penetration holds the rest of the sole above the ground.

    Args:
        plan: Where the feet should be.
    """

    def __init__(self, plan: StancePlan) -> None:
        self._plan = plan
        self._anchors = np.zeros((2, 2, 2))
        self.release()

    def release(self) -> None:
        """Frees both feet."""
        self._held = np.zeros((2, 2, 2), bool)

    def hold(self, t: int) -> None:
        """Chooses frame t of the plan. ``record`` must have been called on frame t - 1."""
        plan, stays = self._plan, self._stays(t)
        axes, slack = plan.axes[t], plan.slack[t]
        anchors = (axes @ self._anchors[..., None])[..., 0]
        footholds = (axes @ plan.footholds[t][..., None])[..., 0]
        centre = np.where(stays[:, None, None], anchors, footholds)
        lower, upper = centre - slack, centre + slack
        held = np.isfinite(slack)
        held[:, TIP] |= (plan.tier[t] == LOOSE)[:, None]
        if t > 0:
            # Nowhere further than a step from the frame before, even if that misses the foothold.
            step = np.where(stays[:, None], np.inf, plan.step[t])[:, :, None]
            np.clip(lower, anchors - step, anchors + step, out=lower)
            np.clip(upper, anchors - step, anchors + step, out=upper)
        self._held = held & np.isfinite(lower)
        self._axes = axes[self._held]
        self._lower, self._upper = lower[self._held], upper[self._held]

    def record(self, configuration: Kinematics, t: int) -> None:
        """Remembers where frame t has put the feet, except those that it held in their place."""
        plan, stays = self._plan, self._stays(t)
        places = configuration.feet()[:, :, :2]
        # Where the foot has reached the planned place it keeps that, so that its window does not wander.
        missed = (plan.axes[t] @ (places - plan.footholds[t])[..., None])[..., 0]
        reached = (np.abs(missed) <= plan.slack[t] + 1e-4).all(axis=2)
        reached &= (plan.tier[t] == ANCHORED)[:, None]
        anchors = np.where(reached[..., None], plan.footholds[t], places)
        self._anchors[~stays] = anchors[~stays]

    def _stays(self, t: int) -> np.ndarray:
        """(2,) whether each foot keeps the place of the frame before."""
        tier = self._plan.tier
        return (tier[t] == ANCHORED) & (tier[t - 1] == ANCHORED) if t > 0 else np.zeros(2, bool)

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns a row for every held axis of a point."""
        if not self._held.any():
            return None
        feet = configuration.feet()
        points = np.nonzero(self._held)[:2]
        jacobian = configuration.feet_jacobians(feet)[points]
        A = (self._axes[:, :, None] * jacobian).sum(axis=1)
        place = (self._axes * feet[:, :, :2][points]).sum(axis=1)
        kind = np.full(len(place), STANCE)
        return Rows(A, self._lower - place, self._upper - place, kind)
