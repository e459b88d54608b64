"""What costs on feet have in common."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting import kernels
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.tasks import CostTask, Quadratic


class FeetTask(CostTask):
    """½ Σ w (row · feet - target)² over linear combinations of what ``Kinematics.feet`` returns."""

    _weights: np.ndarray
    _targets: np.ndarray
    _select: np.ndarray

    def _wish(self, weights: np.ndarray, targets: np.ndarray, rows: np.ndarray) -> None:
        """Sets the (N,) weights and targets, and the rows as (N, 2, 3, 3) factors of ``feet``."""
        self._weights, self._targets, self._select = weights, targets, rows.reshape(-1, 18)

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the Gauss-Newton model of the cost."""
        if not len(self._weights):
            return None
        values, jacobian = configuration.feet().ravel(), configuration.feet_jacobians()
        jacobian = jacobian.reshape(18, -1)
        return Quadratic(
            *kernels.selected_squares(self._select, values, jacobian, self._targets, self._weights)
        )
