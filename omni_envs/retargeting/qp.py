"""The quadratic program of one step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import BoundLimit, RowLimit, Rows
from omni_envs.retargeting.tasks import CostTask

_RIDGE = 1e-6  # keeps the program strictly convex where no task moves a joint


@dataclass(frozen=True, eq=False)
class StepQP:
    """minimise ½ dqᵀH dq + gᵀdq subject to lower ≤ dq ≤ upper, rows, and ‖dq‖_S ≤ radius.

    Attributes:
        H: (nv, nv).
        g: (nv,).
        lower: (nv,).
        upper: (nv,).
        rows: General rows.
        metric: (nv,) diagonal of S.
        radius: Trust region, infinite for none.
    """

    H: np.ndarray
    g: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    rows: Rows
    metric: np.ndarray
    radius: float

    def decrease(self, dq: np.ndarray) -> float:
        """Change of the quadratic cost by a step."""
        return float(dq @ (self.g + 0.5 * (self.H @ dq)))

    def norm(self, dq: np.ndarray) -> float:
        """‖dq‖_S."""
        return float(np.sqrt(self.metric @ (dq * dq)))


def step_rows(configuration: Kinematics, limits: Sequence[RowLimit]) -> Rows:
    """All general rows at a configuration."""
    parts = [rows for limit in limits if (rows := limit.rows(configuration)) is not None]
    if not parts:
        nv = configuration.model.nv
        return Rows(np.zeros((0, nv)), np.zeros(0), np.zeros(0), np.zeros(0, int))
    if len(parts) == 1:
        return parts[0]
    return Rows(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def step_bounds(
    configuration: Kinematics, limits: Sequence[BoundLimit]
) -> tuple[np.ndarray, np.ndarray]:
    """Intersection of all bounds; where rounding leaves it empty, its middle."""
    lower = np.full(configuration.model.nv, -np.inf)
    upper = -lower
    for limit in limits:
        low, high = limit.bounds(configuration)
        np.maximum(lower, low, out=lower)
        np.minimum(upper, high, out=upper)
    crossed = lower > upper
    if crossed.any():
        lower[crossed] = upper[crossed] = 0.5 * (lower[crossed] + upper[crossed])
    return lower, upper


def step_model(
    configuration: Kinematics, tasks: Sequence[CostTask]
) -> tuple[np.ndarray, np.ndarray, float]:
    """H, g and value of the sum of all tasks."""
    nv = configuration.model.nv
    H, g, value = np.zeros((nv, nv)), np.zeros(nv), 0.0
    diagonal = np.full(nv, _RIDGE)
    for task in tasks:
        model = task.quadratic(configuration)
        if model is None:
            continue
        if model.H.ndim == 1:
            diagonal += model.H
        else:
            H += model.H
        g += model.g
        value += model.value
    H.flat[:: nv + 1] += diagonal
    return H, g, value
