"""Turning a foot towards its next foothold before it lands."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting import kernels
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
        foot, arm = np.nonzero(plan.arm_weights[t])
        self._weights = plan.arm_weights[t][foot, arm]
        self._targets = plan.arms[t][foot, arm]
        # Components of ``Kinematics.feet`` that are wished for, as a matrix on all of them.
        select = np.zeros((len(foot), 2, 3, 3))
        select[np.arange(len(foot)), foot, arm + 1, :2] = plan.forward[t][foot]
        self._select = select.reshape(-1, 18)

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the Gauss-Newton model of the cost."""
        if not len(self._weights):
            return None
        arms = self._select @ configuration.feet().ravel()
        J = self._select @ configuration.feet_jacobians().reshape(18, -1)
        return Quadratic(*kernels.weighted_squares(J, arms - self._targets, self._weights))
