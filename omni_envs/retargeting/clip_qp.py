"""The quadratic program of a whole clip, with banded matrices.

The unknown x has a block of n numbers per frame. The cost couples a frame with the next two, a
constraint at most with the next one, so the matrix of an interior-point step has 2n sub-diagonals,
and one banded Cholesky factorisation solves it: some 20 µs per frame at n = 35, linear in the
length of the clip.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided
from scipy.linalg.lapack import dpbtrf

from omni_envs.errors import OmniEnvsError


@dataclass(frozen=True, eq=False)
class Band:
    """Two-sided constraints, lower ≤ (…) ≤ upper.

    A finite stiffness ρ makes them soft, at a cost of ½ρ violation². A multiplier z leaves a
    violation of z/ρ: a stiff one gives way visibly only where constraints contradict each other.

    Attributes:
        lower: Lower bounds, -inf for none.
        upper: Upper bounds, inf for none; the same shape.
        stiffness: ρ, inf for hard; broadcasts against the bounds.
    """

    lower: np.ndarray
    upper: np.ndarray
    stiffness: np.ndarray | float = np.inf


@dataclass(frozen=True, eq=False)
class ClipQP:
    """minimise Σ_t ½ x_tᵀH_t x_t + g_tᵀx_t + x_{t+1}ᵀD_t x_t + x_{t+2}ᵀE_t x_t subject to bands.

    Attributes:
        H: (T, n, n) blocks of single frames.
        g: (T, n).
        D: (T - 1, n) diagonals of the D_t.
        E: (T - 2, n) diagonals of the E_t.
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
    D: np.ndarray
    E: np.ndarray
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
        out[1:] += self.D * x[:-1]
        out[:-1] += self.D * x[1:]
        out[2:] += self.E * x[:-2]
        out[:-2] += self.E * x[2:]
        return out

    def values(self, x: np.ndarray) -> np.ndarray:
        """Values of all constraints, flat: box, change, rows, pairs."""
        pairs = _times(self.B, x[:-1]) + _times(self.C, x[1:])
        parts = (x, x[1:] - x[:-1], _times(self.A, x), pairs)
        return np.concatenate([part.ravel() for part in parts])

    def forces(self, y: np.ndarray) -> np.ndarray:
        """(T, n) transpose of ``values``, times flat multipliers."""
        box, change, rows, pairs = self._split(y)
        out = box + _transposed_times(self.A, rows)
        out[1:] += change
        out[:-1] -= change
        out[:-1] += _transposed_times(self.B, pairs)
        out[1:] += _transposed_times(self.C, pairs)
        return out

    def limits(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lower limits, upper limits and compliances 1/ρ of ``values``, flat."""
        lower = np.concatenate([band.lower.ravel() for band in self._bands])
        upper = np.concatenate([band.upper.ravel() for band in self._bands])
        compliance = [
            np.broadcast_to(1.0 / b.stiffness, b.lower.shape).ravel() for b in self._bands
        ]
        return lower, upper, np.concatenate(compliance)

    def factor(self, weights: np.ndarray) -> np.ndarray:
        """Cholesky factor of Hessian + valuesᵀ diag(weights) values, banded, for ``dpbtrs``."""
        frames, n = self.g.shape
        box, change, rows, pairs = self._split(weights)
        scaled = self.A * np.sqrt(rows)[..., None]
        blocks = np.swapaxes(scaled, 1, 2) @ scaled
        blocks += self.H
        diagonal = blocks.reshape(frames, n * n)[:, :: n + 1]
        diagonal += box
        diagonal[1:] += change
        diagonal[:-1] += change
        below = np.zeros((frames, n, n))
        if self.B.size:
            B, C = np.swapaxes(self.B, 1, 2), np.swapaxes(self.C, 1, 2)
            weighted = self.C * pairs[..., None]
            blocks[:-1] += B @ (self.B * pairs[..., None])
            blocks[1:] += C @ weighted
            below[:-1] = B @ weighted  # transposed: column by column
        below.reshape(frames, n * n)[:-1, :: n + 1] += self.D - change

        # LAPACK wants every column from its diagonal down, 2n + 1 long. Columns of whole blocks fit
        # in there with a stride of 2n: what would lie above the diagonal lies where E belongs.
        depth = 2 * n + 1
        band = np.zeros((frames, n, depth))
        size = band.itemsize
        strides = (n * depth * size, 2 * n * size, size)
        columns = as_strided(band, (frames, n, 2 * n), strides)
        columns[..., :n] = blocks * np.tri(n).T
        columns[..., n:] = below
        band[:-2, :, 2 * n] = self.E
        factor, info = dpbtrf(band.reshape(frames * n, depth).T, lower=1, overwrite_ab=1)
        if info != 0:
            raise OmniEnvsError(f"Clip program: not positive definite at unknown {info}.")
        return factor

    @property
    def _bands(self) -> tuple[Band, Band, Band, Band]:
        return self.box, self.change, self.rows, self.pairs

    def _split(self, y: np.ndarray) -> list[np.ndarray]:
        parts, start = [], 0
        for band in self._bands:
            size = band.lower.size
            parts.append(y[start : start + size].reshape(band.lower.shape))
            start += size
        return parts


def _times(blocks: np.ndarray, x: np.ndarray) -> np.ndarray:
    return (blocks @ x[..., None])[..., 0]


def _transposed_times(blocks: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (y[..., None, :] @ blocks)[..., 0, :]
