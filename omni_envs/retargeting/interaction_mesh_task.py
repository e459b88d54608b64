"""The deformation energy as a task."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting import kernels
from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.tasks import CostTask, Quadratic


class InteractionMeshTask(CostTask):
    """½ w E(q) with the deformation energy E = ‖U p(q) + offset‖² + constant.

    45 residuals instead of the 345 of the whole mesh, with the same cost and gradient.
    """

    def __init__(self, mesh: InteractionMesh, weight: float) -> None:
        self._mesh, self._weight = mesh, weight
        self._moments = np.swapaxes(mesh.factor, 1, 2) @ mesh.factor
        self._moments *= weight
        self.set_frame(0)

    def set_frame(self, t: int) -> None:
        """Chooses the source frame."""
        self._factor, self._offset = self._mesh.factor[t], self._mesh.offset[t]
        self._constant = float(self._mesh.constant[t])
        self._moment = self._moments[t]

    def energy(self, configuration: Kinematics) -> float:
        """Deformation energy, weight 1, m²."""
        residual = self._factor @ configuration.keypoints() + self._offset
        return float(np.square(residual).sum()) + self._constant

    def quadratic(self, configuration: Kinematics) -> Quadratic:
        """Returns the Gauss-Newton model of the cost."""
        residual = self._factor @ configuration.keypoints() + self._offset
        force = self._weight * (self._factor.T @ residual)
        H, g = kernels.coupled_squares(configuration.keypoint_jacobians(), self._moment, force)
        value = 0.5 * self._weight * (float(np.vdot(residual, residual)) + self._constant)
        return Quadratic(H, g, value)
