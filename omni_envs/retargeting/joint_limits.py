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
        self._lower, self._upper = robot.reference_joint_ranges.T.copy()

    def bounds(self, configuration: Kinematics) -> tuple[np.ndarray, np.ndarray]:
        """Returns the way to either limit."""
        joints = configuration.data.qpos[7:]
        lower, upper = np.full(6 + len(joints), -np.inf), np.full(6 + len(joints), np.inf)
        lower[6:], upper[6:] = self._lower - joints, self._upper - joints
        return lower, upper


class StepVelocityLimit(BoundLimit):
    """v_min Δt ≤ q - q_prev ≤ v_max Δt, about the previous **frame** (OmniRetarget eq. 4d).

    mink's velocity limit bounds one solver step instead, which within an SQP loop bounds nothing.
    """

    def __init__(self, robot: Robot, fps: float, fraction: float) -> None:
        # A hair inside, so that a velocity computed from rounded positions satisfies the limit.
        self._step = robot.velocity_limits * (fraction / fps) * (1.0 - 1e-6)
        self._base = np.repeat([_BASE_SPEED, _BASE_TURN], 3) / fps
        self._previous: np.ndarray | None = None

    def set_previous(self, q: np.ndarray | None) -> None:
        """Sets the (nq,) previous frame; None for the first frame, which has no speed."""
        self._previous = q

    def bounds(self, configuration: Kinematics) -> tuple[np.ndarray, np.ndarray]:
        """Returns what is left of the step since the previous frame."""
        nv = configuration.model.nv
        if self._previous is None:
            return np.full(nv, -np.inf), np.full(nv, np.inf)
        back = configuration.difference(self._previous)
        step = np.concatenate([self._base, self._step])
        return back - step, back + step
