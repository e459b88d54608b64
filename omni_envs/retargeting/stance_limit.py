"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import FOOTING, STANCE, RowLimit, Rows
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import ANCHORED, LIFT, LOOSE, StancePlan

TIP, HEART, LEFT = 0, 1, 2
"""Rows of ``Kinematics.feet``: the toe tip, and the arms from there to heart and left."""
_AXES = np.eye(3)
_TORN = 0.01  # m


class StanceLimit(RowLimit):
    """Windows of both feet on the current frame of a plan.

    An anchored foot keeps its **absolute** place: a window about the previous frame, as in the
    official code, lets the foot creep. Toe tip and heart hold the whole sole; while the plan rolls
    the foot over its toes or turns it on them, which is not slip, the heart is free to.
    Non-penetration holds the sole above the ground, and its toes rise no further from it than the
    human's: a foot may come down while it stands, but not float away.

    Args:
        plan: Where the feet should be.
        options: Settings.
    """

    def __init__(self, plan: StancePlan, options: StanceOptions) -> None:
        self._plan, self._options = plan, options
        self._tips, self._arms, self._forward = np.zeros((3, 2, 3))
        self._lowest, self._ceiling = np.zeros(2), np.full(2, np.inf)
        self._supports = np.cross(plan.axes[:, :, 0], plan.axes[:, :, 1])

    def hold(self, t: int) -> None:
        """Chooses frame t of the plan. ``record`` must have been called on frame t - 1."""
        plan, stays = self._plan, self._stays(t)
        self._ceiling[:] = np.inf
        self._normals = self._supports[t]
        self._windows: list[tuple[int, int, np.ndarray, float, float, int]] = []
        tolerance = self._options.heart_tolerance
        for foot in range(2):
            slack, tip = plan.tip_slack[t, foot], self._tips[foot]
            if not stays[foot]:
                low, high = plan.tips[t, foot] - slack, plan.tips[t, foot] + slack
                if t > 0:
                    # Nowhere further than a step from the frame before, even if that misses the
                    # foothold.
                    step = plan.tip_step[t, foot]
                    least, most = tip[:2] - step, tip[:2] + step
                    low = np.minimum(np.maximum(low, least), most)
                    high = np.minimum(np.maximum(high, least), most)
                    if plan.tier[t, foot] == LOOSE:
                        self._hold_level(foot, least, most, STANCE)
                if np.isfinite(slack):
                    self._hold_level(foot, low, high, FOOTING)
                continue
            for along in plan.axes[t, foot]:
                place = float(along @ tip)
                self._hold(foot, TIP, along, place - slack, place + slack)
            self._ceiling[foot] = self._lowest[foot] + plan.rise[t, foot] + LIFT
            if plan.turns[t, foot]:
                continue
            if plan.rolls[t, foot]:
                # The arm to the left keeps no component along the heading.
                self._hold(foot, LEFT, self._forward[foot], -tolerance, tolerance)
                continue
            for along in plan.axes[t, foot]:
                arm = float(along @ self._arms[foot])
                self._hold(foot, HEART, along, arm - tolerance, arm + tolerance)
        if self._windows:
            feet, points, directions, *bounds = map(np.array, zip(*self._windows, strict=True))
            self._lower, self._upper, self._kind = bounds
            select = np.zeros((len(feet), 2, 3, 3))
            select[np.arange(len(feet)), feet, points] = directions
            self._select = select.reshape(-1, 18)

    def _hold_level(self, foot: int, low: np.ndarray, high: np.ndarray, kind: int) -> None:
        """Holds the tip of a foot within the (2,) lowest and highest x and y."""
        for axis in range(2):
            self._hold(foot, TIP, _AXES[axis], low[axis], high[axis], kind)

    def _hold(
        self,
        foot: int,
        point: int,
        direction: np.ndarray,
        low: float,
        high: float,
        kind: int = STANCE,
    ) -> None:
        """Holds the component of a point of a foot along a direction within [low, high]."""
        self._windows.append((foot, point, direction, low, high, kind))

    def record(self, configuration: Kinematics, t: int) -> None:
        """Remembers where frame t has put the feet, except those that it held in their place."""
        plan, feet, stays = self._plan, configuration.feet(), self._stays(t)
        heights = configuration.toe_heights(self._normals)
        for foot in range(2):
            tip, hold = feet[foot, TIP], plan.tips[t, foot]
            turns, rolls = plan.turns[t, foot], plan.rolls[t, foot]
            if stays[foot]:
                self._lowest[foot] = min(self._lowest[foot], heights[foot])
            else:
                # A tip that has reached its foothold keeps that: its window does not wander.
                reached = plan.tier[t, foot] == ANCHORED and (
                    np.abs(tip[:2] - hold).max() <= plan.tip_slack[t, foot] + 1e-4
                )
                self._tips[foot], self._lowest[foot] = tip, heights[foot]
                if reached:
                    self._tips[foot, :2] = hold
            if turns or rolls or not stays[foot]:
                self._arms[foot] = feet[foot, HEART]
            if turns or not stays[foot]:
                x, y, _ = feet[foot, LEFT]
                self._forward[foot] = np.array([y, -x, 0.0]) / np.hypot(x, y)

    def _stays(self, t: int) -> np.ndarray:
        """(2,) whether each foot keeps the place of the frame before."""
        tier = self._plan.tier
        return (tier[t] == ANCHORED) & (tier[t - 1] == ANCHORED) if t > 0 else np.zeros(2, bool)

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows for a held toe tip, two for a whole foot and one for a rolling one.

        And one that keeps a standing foot down.
        """
        if not self._windows:
            return None
        places = self._select @ configuration.feet().ravel()
        A = self._select @ configuration.feet_jacobians().reshape(18, -1)
        lower, upper, kind = self._lower - places, self._upper - places, self._kind
        # A foot that was torn from its place has nothing to stand on.
        beside = np.abs(configuration.feet()[:, TIP, :2] - self._tips[:, :2]).max(axis=1)
        down = np.isfinite(self._ceiling) & (beside < _TORN)
        if down.any():
            room = (self._ceiling - configuration.toe_heights(self._normals))[down]
            gradients = configuration.toe_height_gradients(self._normals)[down]
            A = np.concatenate([A, gradients])
            lower = np.concatenate([lower, np.full(len(room), -np.inf)])
            upper = np.concatenate([upper, room])
            kind = np.concatenate([kind, np.full(len(room), FOOTING)])
        return Rows(A, lower, upper, kind)
