"""Limits on joint positions and on joint speeds between frames."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import BoundLimit
from omni_envs.robots import Robot

_BASE_SPEED, _BASE_TURN = 10.0, 25.0  # m/s and rad/s: only a broken source asks for more


class JointLimit(BoundLimit):
    """q_min ≤ q ≤ q_max, at full gain (mink's own limit closes the gap by 95 % per step)."""

    def __init__(self, robot: Robot) -> None:
        base = np.full((6, 2), [-np.inf, np.inf])
        self._lower, self._upper = np.concatenate([base, robot.reference_joint_ranges]).T.copy()

    def bounds(self, configuration: Kinematics) -> tuple[np.ndarray, np.ndarray]:
        """Returns the way to either limit."""
        lower, upper = self._lower.copy(), self._upper.copy()
        joints = configuration.data.qpos[7:]
        lower[6:] -= joints
        upper[6:] -= joints
        return lower, upper


class StepVelocityLimit(BoundLimit):
    """v_min Δt ≤ q - q_prev ≤ v_max Δt, about the previous **frame** (OmniRetarget eq. 4d).

    mink's velocity limit bounds one solver step instead, which within an SQP loop bounds nothing.
    """

    def __init__(self, robot: Robot, fps: float, fraction: float) -> None:
        # A hair inside, so that a velocity computed from rounded positions satisfies the limit.
        joints = robot.velocity_limits * fraction * (1.0 - 1e-6)
        self._step = np.concatenate([[_BASE_SPEED] * 3, [_BASE_TURN] * 3, joints]) / fps
        self._previous: np.ndarray | None = None

    def set_previous(self, q: np.ndarray | None) -> None:
        """Sets the (nq,) previous frame; None for the first frame, which has no speed."""
        self._previous = q

    def bounds(self, configuration: Kinematics) -> tuple[np.ndarray, np.ndarray]:
        """Returns what is left of the step since the previous frame."""
        if self._previous is None:
            unbounded = np.full(configuration.model.nv, np.inf)
            return -unbounded, unbounded
        back = configuration.difference(self._previous)
        return back - self._step, back + self._step

    def nearest(self, configuration: Kinematics, q: np.ndarray) -> np.ndarray:
        """Returns the (nq,) configuration nearest to ``q`` that the limit allows.

        ``configuration`` moves to the previous frame.
        """
        if self._previous is None:
            return q
        configuration.update(self._previous)
        return configuration.step(np.clip(configuration.difference(q), -self._step, self._step))
