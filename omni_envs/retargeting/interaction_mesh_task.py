"""The deformation energy as a mink task."""

from __future__ import annotations

import mink
import numpy as np

from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.kinematics import Kinematics


class InteractionMeshTask(mink.Task):
    """½ w ‖U p(q) + offset‖²: half the weighted deformation energy up to a constant.

    45 residuals instead of the 345 of the whole mesh, with the same cost and gradient.
    """

    def __init__(self, mesh: InteractionMesh, weight: float) -> None:
        super().__init__(cost=np.full(mesh.factor.shape[1] * 3, np.sqrt(weight)))
        self._mesh = mesh
        self.set_frame(0)

    def set_frame(self, t: int) -> None:
        """Chooses the source frame."""
        self._factor, self._offset = self._mesh.factor[t], self._mesh.offset[t]
        self._constant = float(self._mesh.constant[t])

    def energy(self, configuration: Kinematics) -> float:
        """Deformation energy, weight 1, m²."""
        return float(np.square(self.compute_error(configuration)).sum()) + self._constant

    def compute_error(self, configuration: Kinematics) -> np.ndarray:
        """(45,) residuals, coordinate by coordinate."""
        return (self._factor @ configuration.keypoints() + self._offset).T.ravel()

    def compute_jacobian(self, configuration: Kinematics) -> np.ndarray:
        """(45, nv) Jacobian of the residuals."""
        jacobian = configuration.keypoint_jacobians(configuration.keypoints())
        return (self._factor @ jacobian).reshape(-1, jacobian.shape[-1])
