"""Turning a foot towards its next foothold before it lands."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.feet_task import FeetTask
from omni_envs.retargeting.stance_plan import StancePlan


class FootholdTask(FeetTask):
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
        select = np.zeros((len(foot), 2, 3, 3))
        select[np.arange(len(foot)), foot, arm + 1, :2] = plan.forward[t][foot]
        self._wish(plan.arm_weights[t][foot, arm], plan.arms[t][foot, arm], select)
