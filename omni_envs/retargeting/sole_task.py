"""Standing on the whole sole where the human does."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.feet_task import FeetTask
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.ramps import ramps


class SoleTask(FeetTask):
    """½ w Σ (n · p - h)² over toe tip and heart of soles: n · p = h is what the human stands on.

    And over the arm from the tip to the left, which is to lie in that plane. The interaction mesh
    wants the ankles where the human's are: a robot with short legs, or with long feet, goes on
    tiptoe for that.

    Args:
        human: What the human's feet do.
        fps: Frames per second.
        weight: w, 1/m².
    """

    def __init__(self, human: HumanFeet, fps: float, weight: float) -> None:
        grow, nearest = ramps(human.flat.T, fps)
        nearest, foot = nearest.T, np.arange(2)
        axes = human.axes[nearest, foot]
        normals = np.cross(axes[..., 0, :], axes[..., 1, :])
        self._pull = weight * grow.T
        self._heights = np.where(grow.T > 0.0, human.support[nearest, foot], 0.0)
        # Rows on ``Kinematics.feet``: tip, tip + arm to the heart, arm to the left.
        rows = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        self._rows = rows[:, :, None] * normals[:, :, None, None, :]
        self.set_frame(0)

    def set_frame(self, t: int) -> None:
        """Chooses the source frame."""
        feet = np.flatnonzero(self._pull[t])
        select = np.zeros((len(feet), 3, 2, 3, 3))
        select[np.arange(len(feet)), :, feet] = self._rows[t, feet]
        targets = np.outer(self._heights[t, feet], (1.0, 1.0, 0.0)).ravel()
        self._wish(np.repeat(self._pull[t, feet], 3), targets, select)
