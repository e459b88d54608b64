"""Turning a foot towards its next foothold before it lands."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.stance_plan import StancePlan
from omni_envs.retargeting.tasks import CostTask, Quadratic


class FootholdTask(CostTask):
    """½ Σ w (arm · forward - planned)²: heading and pitch of a foot that lands or stands.

    A cost, not a limit: a foot that cannot turn in time lands as it is, and ``StanceLimit`` keeps
    that.
    """

    def __init__(self, plan: StancePlan) -> None:
        self._plan = plan
        self.set_frame(0)

    def set_frame(self, t: int) -> None:
        """Chooses a frame of the plan."""
        plan = self._plan
        self._index = np.nonzero(plan.arm_weights[t])
        self._weights = plan.arm_weights[t][self._index]
        self._targets = plan.arms[t][self._index]
        self._forward = plan.forward[t][self._index[0]]

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the Gauss-Newton model of the cost."""
        if not len(self._weights):
            return None
        foot, arm = self._index
        feet = configuration.feet()
        arms = feet[foot, arm + 1, :2]
        residual = (arms * self._forward).sum(axis=1) - self._targets
        jacobian = configuration.feet_jacobians()[foot, arm + 1]
        J = (jacobian * self._forward[:, :, None]).sum(axis=1)
        weighted = J * self._weights[:, None]
        value = 0.5 * float(self._weights @ np.square(residual))
        return Quadratic(J.T @ weighted, residual @ weighted, value)
