"""What all tasks have in common."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import mink
import numpy as np
from mink.tasks import BaseTask

from omni_envs.retargeting.kinematics import Kinematics


class Quadratic(NamedTuple):
    """value + gᵀdq + ½ dqᵀH dq; a vector H is a diagonal."""

    H: np.ndarray
    g: np.ndarray
    value: float


class CostTask(BaseTask):
    """A mink task that also tells its value, all from one evaluation."""

    @abstractmethod
    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the quadratic model of the cost at a configuration; None where it is off."""

    def compute_qp_objective(self, configuration: Kinematics) -> mink.Objective:
        """Returns H and c of the quadratic model, for ``mink.build_ik``."""
        model, nv = self.quadratic(configuration), configuration.model.nv
        if model is None:
            return mink.Objective(np.zeros((nv, nv)), np.zeros(nv))
        return mink.Objective(np.diag(model.H) if model.H.ndim == 1 else model.H, model.g)
