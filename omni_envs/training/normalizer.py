"""Running normalisation of observations as a layer, saved and exported with the network."""

from __future__ import annotations

import torch
from torch import Tensor, nn

STD_FLOOR = 1e-2
"""Added to the standard deviation (rsl_rl): a constant observation is not blown up."""


class RunningNormalizer(nn.Module):
    """(x − μ) / (σ + 10⁻²) with the mean and deviation of everything it has been fed.

    Until it is fed it passes observations through.

    Args:
        size: Number of features.
    """

    mean: Tensor
    variance: Tensor
    count: Tensor

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("variance", torch.ones(size))
        self.register_buffer("count", torch.zeros((), dtype=torch.int64))

    def forward(self, x: Tensor) -> Tensor:
        """Normalises (…, size) features."""
        return (x - self.mean) / (self.variance.sqrt() + STD_FLOOR)

    @torch.no_grad()
    def update(self, x: Tensor) -> None:
        """Merges (N, size) samples into mean and variance (Chan, Golub and LeVeque 1979)."""
        variance, mean = torch.var_mean(x.double(), dim=0, correction=0)
        old, new = int(self.count), x.shape[0]
        if old == 0:
            merged_mean, merged_variance = mean, variance
        else:
            share = new / (old + new)
            delta = mean - self.mean
            merged_mean = self.mean + share * delta
            merged_variance = (
                (1 - share) * self.variance + share * variance + share * (1 - share) * delta**2
            )
        self.mean.copy_(merged_mean)
        self.variance.copy_(merged_variance)
        self.count += new
