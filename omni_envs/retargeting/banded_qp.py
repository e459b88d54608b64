"""Quadratic programs along a clip: block-banded interior point.

The unknown x has one block of n numbers per frame. The cost couples a frame with the next two, a constraint
at most with the next one, so every matrix of an interior-point step is banded with 2n sub-diagonals, and a
step costs one banded Cholesky factorisation (LAPACK ``pbtrf``): some 20 µs per frame at n = 35, linear in
the length of the clip. A general sparse solver pays a hundred times that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from omni_envs.errors import OmniEnvsError


@dataclass(frozen=True, eq=False)
class Band:
    """Two-sided constraints lower ≤ (…) ≤ upper, infinite where there are none.

    A finite ``stiffness`` ρ makes them soft at a cost of ½ρ (violation)²: with multipliers z the violation
    is z/ρ, so that a stiff constraint gives way only where constraints contradict each other.

    Attributes:
        lower: Lower bounds.
        upper: Upper bounds, the same shape.
        stiffness: ρ, infinite for hard; broadcasts against the bounds.
    """

    lower: np.ndarray
    upper: np.ndarray
    stiffness: np.ndarray | float = np.inf


@dataclass(frozen=True, eq=False)
class ClipQP:
    """minimise Σ_t ½ x_tᵀH_t x_t + g_tᵀx_t + x_{t+1}ᵀD_t x_t + x_{t+2}ᵀE_t x_t, D and E diagonal.

    Attributes:
        H: (T, n, n) blocks of single frames.
        g: (T, n).
        next: (T - 1, n) diagonals of the D_t.
        second: (T - 2, n) diagonals of the E_t.
        box: (T, n) limits on x_t.
        change: (T - 1, n) limits on x_{t+1} - x_t.
        rows: (T, M) limits on A_t x_t.
        A: (T, M, n); rows without finite limits are padding.
        pairs: (T - 1, P) limits on B_t x_t + C_t x_{t+1}.
        B: (T - 1, P, n).
        C: (T - 1, P, n).
    """

    H: np.ndarray
    g: np.ndarray
    next: np.ndarray
    second: np.ndarray
    box: Band
    change: Band
    rows: Band
    A: np.ndarray
    pairs: Band
    B: np.ndarray
    C: np.ndarray

    def cost(self, x: np.ndarray) -> float:
        """The quadratic cost of (T, n)."""
        return float(np.vdot(x, 0.5 * self.curvature(x) + self.g))

    def curvature(self, x: np.ndarray) -> np.ndarray:
        """(T, n) Hessian of the cost times x."""
        out = _times(self.H, x)
        out[1:] += self.next * x[:-1]
        out[:-1] += self.next * x[1:]
        out[2:] += self.second * x[:-2]
        out[:-2] += self.second * x[2:]
        return out

    def constraints(self, x: np.ndarray) -> np.ndarray:
        """Values of all constraints, flat: box, change, rows, pairs."""
        pair = _times(self.B, x[:-1]) + _times(self.C, x[1:])
        return np.concatenate(
            [x.ravel(), (x[1:] - x[:-1]).ravel(), _times(self.A, x).ravel(), pair.ravel()]
        )

    def pull(self, y: np.ndarray) -> np.ndarray:
        """(T, n) transpose of ``constraints`` times flat multipliers."""
        box, change, rows, pairs = self._split(y)
        out = box.reshape(self.g.shape) + _times_transposed(self.A, rows)
        out[1:] += change
        out[:-1] -= change
        out[:-1] += _times_transposed(self.B, pairs)
        out[1:] += _times_transposed(self.C, pairs)
        return out

    def limits(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Flat lower limits, upper limits and compliances 1/ρ of ``constraints``."""
        bands = (self.box, self.change, self.rows, self.pairs)
        compliance = [
            np.broadcast_to(1.0 / np.asarray(b.stiffness, float), b.lower.shape) for b in bands
        ]
        return (
            np.concatenate([b.lower.ravel() for b in bands]),
            np.concatenate([b.upper.ravel() for b in bands]),
            np.concatenate([c.ravel() for c in compliance]),
        )

    def factor(self, weights: np.ndarray) -> np.ndarray:
        """Banded Cholesky factor of the Hessian plus constraintsᵀ diag(weights) constraints."""
        frames, n = self.g.shape
        box, change, rows, pairs = self._split(weights)
        diagonal = self.H + np.swapaxes(self.A, 1, 2) @ (self.A * rows[..., None])
        own = diagonal.reshape(frames, n * n)[:, :: n + 1]
        own += box
        own[1:] += change
        own[:-1] += change
        weighted = self.C * pairs[..., None]
        diagonal[:-1] += np.swapaxes(self.B, 1, 2) @ (self.B * pairs[..., None])
        diagonal[1:] += np.swapaxes(self.C, 1, 2) @ weighted
        # Row j of ``band`` holds column j of the matrix from its diagonal down.
        band = np.zeros((frames, n, 2 * n + 1))
        flat = band.reshape(frames, n * (2 * n + 1))
        i, j = np.tril_indices(n)
        flat[:, j * (2 * n + 1) + i - j] = diagonal[:, i, j]
        band[:-1, :, n] += self.next - change
        band[:-2, :, 2 * n] += self.second
        coupled = np.flatnonzero(pairs.any(axis=1))
        if len(coupled):
            i, j = np.indices((n, n)).reshape(2, -1)
            block = np.swapaxes(weighted[coupled], 1, 2) @ self.B[coupled]
            flat[coupled[:, None], j * (2 * n + 1) + n + i - j] += block.reshape(len(coupled), -1)
        factor, info = dpbtrf(band.reshape(frames * n, -1).T, lower=1, overwrite_ab=1)
        if info != 0:
            raise OmniEnvsError(f"Clip program: not positive definite at unknown {info}.")
        return factor

    def _split(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        bands = (self.box, self.change, self.rows, self.pairs)
        ends = np.cumsum([0, *(b.lower.size for b in bands)])
        box, change, rows, pairs = (
            y[a:b].reshape(band.lower.shape)
            for a, b, band in zip(ends[:-1], ends[1:], bands, strict=True)
        )
        return box, change, rows, pairs


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the interior point stopped.

    Attributes:
        x: (T, n).
        iterations: Factorisations.
        gap: Mean complementarity of the constraints.
        residual: Largest residual of the optimality conditions.
    """

    x: np.ndarray
    iterations: int
    gap: float
    residual: float


def solve_clip_qp(
    qp: ClipQP, tolerance: float = 1e-7, iterations: int = 40, start_gap: float = 1e-3
) -> Solution:
    """Solves a program by Mehrotra's predictor-corrector method.

    Args:
        qp: The program; strictly feasible in its hard constraints.
        tolerance: Mean complementarity, and residuals of feasibility, to stop at.
        iterations: Most steps.
        start_gap: Complementarity to begin with.
    """
    lower, upper, compliance = qp.limits()
    low, high = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
    which = np.concatenate([low, high])
    sign = np.concatenate([np.ones(len(low)), -np.ones(len(high))])
    bound = np.concatenate([lower[low], -upper[high]])
    give = compliance[which]
    count, size = len(which), len(lower)

    def spread(values: np.ndarray) -> np.ndarray:
        """Flat sums over the two sides of every constraint."""
        out = np.zeros(size)
        out[low] += values[: len(low)]
        out[high] += values[len(low) :]
        return out

    x = np.zeros_like(qp.g)
    slack = np.maximum(sign * qp.constraints(x)[which] - bound, 1e-2)
    z = start_gap / slack
    step, gap, residual = 0, start_gap, np.inf
    for step in range(1, iterations + 1):  # noqa: B007
        dual = qp.curvature(x) + qp.g - qp.pull(spread(sign * z))
        primal = sign * qp.constraints(x)[which] - bound + give * z - slack
        gap = float(slack @ z) / max(count, 1)
        residual = float(max(np.abs(dual).max(), np.abs(primal).max(initial=0.0)))
        if gap <= tolerance and residual <= 10.0 * tolerance:
            break
        weight = 1.0 / (give + slack / z)
        factor = qp.factor(spread(weight))

        def direction(
            complementarity: np.ndarray,
            weight: np.ndarray = weight,
            primal: np.ndarray = primal,
            dual: np.ndarray = dual,
            factor: np.ndarray = factor,
            z: np.ndarray = z,
            slack: np.ndarray = slack,
        ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            shift = primal + complementarity / z
            right = -dual - qp.pull(spread(sign * weight * shift))
            dx = dpbtrs(factor, right.ravel(), lower=1)[0].reshape(x.shape)
            dz = -weight * (shift + sign * qp.constraints(dx)[which])
            return dx, dz, -(complementarity + slack * dz) / z

        dx, dz, ds = direction(slack * z)
        length = min(_reach(slack, ds), _reach(z, dz))
        predicted = float((slack + length * ds) @ (z + length * dz)) / max(count, 1)
        centre = gap * (predicted / gap) ** 3 if gap > 0 else 0.0
        dx, dz, ds = direction(slack * z + ds * dz - centre)
        length = 0.995 * min(_reach(slack, ds), _reach(z, dz))
        length = min(1.0, length)
        x, slack, z = x + length * dx, slack + length * ds, z + length * dz
    return Solution(x, step, gap, residual)


def _reach(values: np.ndarray, change: np.ndarray) -> float:
    """Longest step in [0, 1] that keeps values + step · change ≥ 0."""
    falling = change < 0
    return float(min(1.0, np.min(-values[falling] / change[falling], initial=1.0)))


def _times(blocks: np.ndarray, x: np.ndarray) -> np.ndarray:
    return (blocks @ x[..., None])[..., 0]


def _times_transposed(blocks: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (y[..., None, :] @ blocks)[..., 0, :]
