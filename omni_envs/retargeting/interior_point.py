"""Mehrotra's predictor-corrector interior-point method on the banded program of a clip.

Every finite side of a constraint becomes c(x) + z/ρ = s with s, z ≥ 0, where z/ρ is how far a soft
one gives way. A step solves, with W = 1 / (1/ρ + s/z),

    (H + JᵀWJ) dx = -r_dual - JᵀW (r_primal + r_centre / z),

which is as banded as H and J are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpbtrs

from omni_envs.retargeting.clip_qp import ClipQP

# Where steps of centimetres with multipliers of the order of 1 take the fewest iterations.
_START_SLACK, _START_GAP = 0.02, 0.1
_TO_BOUNDARY = 0.995


@dataclass(frozen=True, eq=False)
class ClipSolution:
    """Where the interior point stopped.

    Attributes:
        x: (T, n).
        iterations: Factorisations.
        gap: Mean product of slack and multiplier.
        residual: Largest violation of an optimality condition.
    """

    x: np.ndarray
    iterations: int
    gap: float
    residual: float


def solve_clip_qp(qp: ClipQP, tolerance: float = 1e-6, iterations: int = 40) -> ClipSolution:
    """Solves a program. Soft constraints may contradict each other; hard ones may not.

    Args:
        qp: The program.
        tolerance: Gap to stop at; residuals stop at ten times that.
        iterations: Most steps.
    """
    return _InteriorPoint(qp).solve(tolerance, iterations)


class _InteriorPoint:
    """State of the method: x, and slack and multiplier of every finite side of a constraint."""

    def __init__(self, qp: ClipQP) -> None:
        self.qp = qp
        lower, upper, compliance = qp.limits()
        below, above = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.size, self.below, self.above = len(lower), below, above
        self.which = np.concatenate([below, above])
        self.sign = np.repeat([1.0, -1.0], [len(below), len(above)])
        self.bound = np.concatenate([lower[below], -upper[above]])
        self.compliance = compliance[self.which]
        self.x = np.zeros_like(qp.g)
        self.slack = np.maximum(self._sides(self.x) - self.bound, _START_SLACK)
        self.z = _START_GAP / self.slack

    def solve(self, tolerance: float, iterations: int) -> ClipSolution:
        qp, count = self.qp, max(len(self.which), 1)
        for done in range(iterations + 1):
            dual = qp.curvature(self.x) + qp.g - qp.forces(self._sum(self.sign * self.z))
            primal = self._sides(self.x) - self.bound + self.compliance * self.z - self.slack
            gap = float(self.slack @ self.z) / count
            residual = float(max(np.abs(dual).max(), np.abs(primal).max(initial=0.0)))
            if (gap <= tolerance and residual <= 10.0 * tolerance) or done == iterations:
                break
            self._advance(dual, primal, gap)
        return ClipSolution(self.x, done, gap, residual)

    def _advance(self, dual: np.ndarray, primal: np.ndarray, gap: float) -> None:
        slack, z = self.slack, self.z
        weight = 1.0 / (self.compliance + slack / z)
        factor = self.qp.factor(self._sum(weight))

        def direction(centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            shift = primal + centre / z
            right = -dual - self.qp.forces(self._sum(self.sign * weight * shift))
            dx = dpbtrs(factor, right.ravel(), lower=1)[0].reshape(dual.shape)
            dz = -weight * (shift + self._sides(dx))
            return dx, dz, -(centre + slack * dz) / z

        dx, dz, ds = direction(slack * z)
        reach = min(1.0, _reach(slack, ds), _reach(z, dz))
        predicted = float((slack + reach * ds) @ (z + reach * dz)) / max(len(z), 1)
        target = gap * max(predicted / gap, 0.0) ** 3 if gap > 0 else 0.0
        dx, dz, ds = direction(slack * z + ds * dz - target)
        reach = min(1.0, _TO_BOUNDARY * min(_reach(slack, ds), _reach(z, dz)))
        self.x = self.x + reach * dx
        self.slack, self.z = slack + reach * ds, z + reach * dz

    def _sides(self, x: np.ndarray) -> np.ndarray:
        """Values of the sides, increasing into the feasible set."""
        return self.sign * self.qp.values(x)[self.which]

    def _sum(self, sides: np.ndarray) -> np.ndarray:
        """Sum of the two sides of each constraint."""
        out = np.zeros(self.size)
        out[self.below] = sides[: len(self.below)]
        out[self.above] += sides[len(self.below) :]
        return out


def _reach(values: np.ndarray, change: np.ndarray) -> float:
    """Longest multiple of a change that keeps values non-negative, at most 1 / ``_TO_BOUNDARY``."""
    falling = change < 0
    ratio = -values[falling] / change[falling]
    return float(ratio.min(initial=1.0 / _TO_BOUNDARY))
