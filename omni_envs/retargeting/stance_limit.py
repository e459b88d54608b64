"""Planted feet stay where they are."""

from __future__ import annotations

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows

FREE, LOOSE, ANCHORED = 0, 1, 2
"""Tiers of a foot in a frame."""


class StanceLimit(RowLimit):
    """Windows of the sole points of planted feet.

    An anchored foot keeps every sole point within ``tolerance`` of its place at the **start** of the
    interval: a window about the previous frame, as in the official code, lets the foot creep. A loose foot
    moves at most ``step`` per frame. Horizontally two-sided; an anchored foot may sink but not rise.

    Args:
        tolerance: Half width of the anchor window, m.
        step: Largest horizontal move of a loose sole point per frame, m.
    """

    def __init__(self, tolerance: float, step: float) -> None:
        self._tolerance = tolerance
        self._step = step / np.sqrt(2.0)  # half side of the square inside the circle
        self._anchor: np.ndarray | None = None
        self._half: np.ndarray | None = None

    def hold(self, anchor: np.ndarray, tier: np.ndarray) -> None:
        """Sets the (2, K, 3) places that the sole points keep and the (2,) tier of each foot."""
        feet = np.flatnonzero(tier)
        self._feet = feet
        self._anchor = anchor[feet, :, :2]
        half = np.where(tier[feet] == ANCHORED, self._tolerance, self._step)
        self._half = np.repeat(half, anchor.shape[1] * 2)

    def release(self) -> None:
        """Frees both feet."""
        self._anchor = None

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows per sole point of a held foot."""
        if self._anchor is None or not len(self._anchor):
            return None
        soles = configuration.soles()
        jacobian = configuration.sole_jacobians(soles)[:2, self._feet]
        A = np.moveaxis(jacobian, 0, 2).reshape(-1, jacobian.shape[-1])
        gap = (self._anchor - soles[self._feet, :, :2]).ravel()
        kind = np.full(len(gap), STANCE)
        return Rows(A, gap - self._half, gap + self._half, kind)
