"""Solving the step: DAQP, an exact trust region, graded softness where constraints contradict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import daqp
import numpy as np

from omni_envs.retargeting.clarabel_solver import solve_clarabel
from omni_envs.retargeting.qp import StepQP
from omni_envs.retargeting.softness import softness

_SOFT = 8
_RADIUS_TOLERANCE = 5e-3


class StepSolver(Protocol):
    """Solves a step."""

    def __call__(self, qp: StepQP) -> tuple[np.ndarray, bool]:
        """Returns the step (nv,) and whether general rows had to give way."""


def solve_daqp(qp: StepQP) -> tuple[np.ndarray, bool]:
    """Solves a step with DAQP. Never fails: bounds hold, contradicting rows give way in order."""
    return solve_on_cone(qp, _solve, _solve_soft)


def solve_on_cone(
    qp: StepQP,
    hard: Callable[[StepQP, float], np.ndarray | None],
    soft: Callable[[StepQP, float], np.ndarray],
) -> tuple[np.ndarray, bool]:
    """Solves a step with a solver of quadratic programs.

    The second-order cone ‖dq‖_S ≤ ε is active exactly when the program with H + λS has its solution
    on the cone, so λ is searched only when the free step is too long.

    Args:
        qp: The step.
        hard: Solves it with a given λ and without the cone; None where rows contradict each other.
        soft: The same with soft rows.
    """
    dq = hard(qp, 0.0)
    if dq is not None:
        dq = _within(qp, dq, hard)
        if dq is not None:
            return dq, False
    dq = soft(qp, 0.0)
    inside = _within(qp, dq, soft)
    return (dq * (qp.radius / qp.norm(dq)) if inside is None else inside), True


def _within(
    qp: StepQP, dq: np.ndarray, solve: Callable[[StepQP, float], np.ndarray | None]
) -> np.ndarray | None:
    """The solution on the cone, given the one without; None where rows and cone contradict."""
    norm = qp.norm(dq)
    if norm <= qp.radius * (1 + _RADIUS_TOLERANCE):
        return dq
    # ‖dq(λ)‖ falls with λ, and 1/‖dq(λ)‖ is nearly linear: a bracketed secant takes few steps.
    scale = float(np.trace(qp.H) / qp.metric.sum())
    low, high = 0.0, np.inf
    before, damping = (0.0, 1.0 / norm), 0.1 * scale * (norm / qp.radius - 1.0)
    while damping < 1e7 * scale:
        trial = solve(qp, damping)
        if trial is None:
            return None
        norm = max(qp.norm(trial), 1e-12)
        if abs(norm / qp.radius - 1.0) <= _RADIUS_TOLERANCE or high - low < 1e-6 * high:
            return trial
        if norm > qp.radius:
            low = damping
            if damping > 5.0 * before[0] > scale and norm * before[1] > 0.999:
                return None  # the shortest step that the rows leave is longer
        else:
            high = damping
        slope = (1.0 / norm - before[1]) / (damping - before[0])
        before = (damping, 1.0 / norm)
        damping += (1.0 / qp.radius - 1.0 / norm) / slope if slope > 0 else np.inf
        if not low < damping < min(high, 100.0 * max(low, scale)):
            damping = 0.5 * (low + high) if np.isfinite(high) else 10.0 * max(low, 0.1 * scale)
    return None


def _program(qp: StepQP, damping: float) -> tuple[np.ndarray, ...]:
    H = qp.H
    if damping:
        H = H.copy()
        H.flat[:: len(H) + 1] += damping * qp.metric
    upper = np.concatenate([qp.upper, qp.rows.upper])
    lower = np.concatenate([qp.lower, qp.rows.lower])
    np.minimum(upper, 1e30, out=upper)  # DAQP's infinity
    np.maximum(lower, -1e30, out=lower)
    return H, qp.g, np.ascontiguousarray(qp.rows.A), upper, lower


def _solve(qp: StepQP, damping: float) -> np.ndarray | None:
    program = _program(qp, damping)
    dq, _, flag, _ = daqp.solve(*program, np.zeros(len(program[3]), np.intc), eps_prox=0.0)
    # DAQP keeps bounds to 1e-6 only.
    return np.minimum(np.maximum(dq, qp.lower), qp.upper) if flag > 0 else None


def _solve_soft(qp: StepQP, damping: float) -> np.ndarray:
    """Solves with soft rows; bounds stay hard and always leave a step."""
    H, g, A, upper, lower = _program(qp, damping)
    n = len(g)
    sense = np.zeros(len(upper), np.intc)
    sense[n:] = _SOFT
    reciprocal, linear = np.ones(len(upper)), np.zeros(len(upper))
    quadratic, linear[n:] = softness(qp.rows.kind)
    reciprocal[n:] = 1.0 / quadratic
    model = daqp.Model()
    model.setup(H, g, A, upper, lower, sense)
    model.soft_weights(reciprocal, reciprocal, linear, linear)
    dq, _, flag, _ = model.solve()
    if flag <= 0:
        # DAQP may cycle on many nearly parallel soft rows; the interior point does not.
        damped = replace(qp, H=H, radius=np.inf)
        return solve_clarabel(damped)[0]
    return np.minimum(np.maximum(dq, qp.lower), qp.upper)
