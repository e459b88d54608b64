"""Points and Jacobians of many frames at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics, Points


@dataclass(frozen=True, eq=False)
class ClipKinematics:
    """Points on F frames.

    Attributes:
        positions: (F, P, 3) world points.
        axes: (F, nv, 6) spatial axes of the degrees of freedom, angular part first.
        arms: (F, P, 3) points from where the axes are taken.
        mask: (P, nv) 1 where a degree of freedom moves a point.
    """

    positions: np.ndarray
    axes: np.ndarray
    arms: np.ndarray
    mask: np.ndarray

    @cached_property
    def jacobians(self) -> np.ndarray:
        """(F, 3, P, nv) Jacobians, mask ⊙ (linear + angular × arm)."""
        out = np.empty((len(self.axes), 3, *self.mask.shape))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            out[:, i] = self.axes[:, None, :, j] * self.arms[:, :, None, k]
            out[:, i] -= self.axes[:, None, :, k] * self.arms[:, :, None, j]
            out[:, i] += self.axes[:, None, :, 3 + i]
        out *= self.mask
        return out


def trace_clip(
    configuration: Kinematics,
    points: Points,
    qpos: np.ndarray,
    start: int,
    stop: int,
    place: Callable[[int], None],
    visit: Callable[[int], None] | None = None,
) -> ClipKinematics:
    """Visits the frames [start, stop) of a motion and keeps what the points' Jacobians need.

    Args:
        configuration: Kinematics of the robot.
        points: The points.
        qpos: (T, nq) configurations.
        start: First frame.
        stop: End of the frames.
        place: Called before a frame is computed, to place the object.
        visit: Called while the configuration is at a frame.
    """
    data, model, count = configuration.data, configuration.model, stop - start
    root = int(model.body(configuration.robot.root_body).id)
    axes, centres = np.empty((count, model.nv, 6)), np.empty((count, 1, 3))
    origins = np.empty((count, len(points.bodies), 3))
    rotations = np.empty((count, len(points.bodies), 9))
    for i, t in enumerate(range(start, stop)):
        place(t)
        configuration.update(qpos[t])
        axes[i], centres[i] = data.cdof, data.subtree_com[root]
        origins[i], rotations[i] = data.xpos[points.bodies], data.xmat[points.bodies]
        if visit is not None:
            visit(t)
    offsets = rotations.reshape(count, -1, 3, 3) @ points.offsets[:, :, None]
    positions = origins + offsets[..., 0]
    return ClipKinematics(
        positions, axes, positions - centres, configuration.ancestors[points.bodies]
    )
