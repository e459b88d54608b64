"""Staying near a configuration: smoothness, nominal pose and posture are all this."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.tasks import CostTask, Quadratic


class ProximalTask(CostTask):
    """½ Σ_i w_i (q ⊖ q_target)_i².

    Args:
        weights: (nv,) weights.
    """

    def __init__(self, weights: np.ndarray) -> None:
        self._weights = weights
        self._target: np.ndarray | None = None

    def set_target(self, q: np.ndarray | None) -> None:
        """Sets the (nq,) target; None switches the task off."""
        self._target = q

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the cost about a configuration, with a diagonal Hessian."""
        if self._target is None:
            return None
        way = configuration.difference(self._target)
        g = -self._weights * way
        return Quadratic(self._weights, g, -0.5 * float(g @ way))
