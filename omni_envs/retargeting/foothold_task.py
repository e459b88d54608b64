"""Turning a foot towards its next foothold before it lands."""

from __future__ import annotations

import mink
import numpy as np
from mink.tasks import BaseTask

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.stance_plan import StancePlan


class FootholdTask(BaseTask):
    """½ Σ w (arm · forward - planned)²: heading and pitch of a foot that lands or stands.

    A cost, not a limit: a foot that cannot turn in time lands as it is, and ``StanceLimit`` keeps that.
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

    def _residual(self, configuration: Kinematics) -> np.ndarray:
        foot, arm = self._index
        arms = configuration.feet()[foot, arm + 1, :2]
        return (arms * self._forward).sum(axis=1) - self._targets

    def cost(self, configuration: Kinematics) -> float:
        """The cost at a configuration."""
        if not len(self._weights):
            return 0.0
        return 0.5 * float(self._weights @ np.square(self._residual(configuration)))

    def compute_qp_objective(self, configuration: Kinematics) -> mink.Objective:
        """Returns H and c of the quadratic model."""
        nv = configuration.model.nv
        if not len(self._weights):
            return mink.Objective(np.zeros((nv, nv)), np.zeros(nv))
        foot, arm = self._index
        jacobian = configuration.feet_jacobians(configuration.feet())[foot, arm + 1]
        J = (jacobian * self._forward[:, :, None]).sum(axis=1)
        weighted = J * self._weights[:, None]
        return mink.Objective(J.T @ weighted, self._residual(configuration) @ weighted)
