"""Two shapes of limit, both usable as ``mink.Limit``: bounds on dq and two-sided rows."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import mink
import numpy as np

from omni_envs.retargeting.kinematics import Kinematics

STANCE, SELF, CONTACT, FOOTING = 0, 1, 2, 3
"""Kinds of rows: the constraints, the first to give way first (the order of
``result.RELAXATIONS``), and what is only wished of feet, which gives way before all of them: the
way to a planned foothold (a foot that cannot reach it lands beside it rather than pull the other
foot away), and that a standing foot stays down."""


class Rows(NamedTuple):
    """lower ≤ A dq ≤ upper.

    Attributes:
        A: (N, nv).
        lower: (N,).
        upper: (N,).
        kind: (N,) ``STANCE``, ``SELF``, ``CONTACT`` or ``FOOTING``.
    """

    A: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    kind: np.ndarray


class BoundLimit(mink.Limit):
    """A limit of the form lower ≤ dq ≤ upper; infinite where it does not apply."""

    @abstractmethod
    def bounds(self, configuration: Kinematics) -> tuple[np.ndarray, np.ndarray]:
        """Returns (nv,) lower and (nv,) upper bound of dq."""

    def compute_qp_inequalities(self, configuration: Kinematics, dt: float) -> mink.Constraint:
        """Returns the bounds as one-sided rows G dq ≤ h, for ``mink.build_ik``."""
        lower, upper = self.bounds(configuration)
        eye = np.eye(len(lower))
        G, h = np.vstack([eye, -eye]), np.concatenate([upper, -lower])
        finite = np.isfinite(h)
        return mink.Constraint(G[finite], h[finite])


class RowLimit(mink.Limit):
    """A limit of the form lower ≤ A dq ≤ upper."""

    @abstractmethod
    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns the rows at this configuration, None where there are none."""

    def compute_qp_inequalities(self, configuration: Kinematics, dt: float) -> mink.Constraint:
        """Returns the rows one-sided, G dq ≤ h, for ``mink.build_ik``."""
        rows = self.rows(configuration)
        if rows is None:
            return mink.Constraint()
        G, h = np.vstack([rows.A, -rows.A]), np.concatenate([rows.upper, -rows.lower])
        finite = np.isfinite(h)
        return mink.Constraint(G[finite], h[finite])
