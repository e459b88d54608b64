"""Staying near a configuration: smoothness, nominal pose and posture are all this."""

from __future__ import annotations

import mink
import numpy as np
from mink.tasks import BaseTask

from omni_envs.retargeting.kinematics import Kinematics


class ProximalTask(BaseTask):
    """½ Σ_i w_i (q ⊖ q_target)_i².

    Args:
        weights: (nv,) weights.
    """

    def __init__(self, weights: np.ndarray) -> None:
        self.weights = weights
        self._target: np.ndarray | None = None

    def set_target(self, q: np.ndarray | None) -> None:
        """Sets the (nq,) target; None switches the task off."""
        self._target = q

    def gradient(self, configuration: Kinematics) -> np.ndarray:
        """(nv,) gradient; the Hessian is the diagonal of the weights."""
        if self._target is None:
            return np.zeros(len(self.weights))
        return -self.weights * configuration.difference(self._target)

    @property
    def hessian(self) -> np.ndarray:
        """(nv,) diagonal Hessian."""
        return self.weights if self._target is not None else np.zeros(len(self.weights))

    def cost(self, configuration: Kinematics) -> float:
        """The cost at a configuration."""
        if self._target is None:
            return 0.0
        return 0.5 * float(self.weights @ np.square(configuration.difference(self._target)))

    def compute_qp_objective(self, configuration: Kinematics) -> mink.Objective:
        """Returns H and c of the quadratic model."""
        return mink.Objective(np.diag(self.hessian), self.gradient(configuration))
