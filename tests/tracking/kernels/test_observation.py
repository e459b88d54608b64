"""Chance; ``tests/envs/test_compiled.py`` holds the rest to the plain functions."""

import numpy as np

from omni_envs.tracking import kernels


def test_chance_is_uniform_and_without_memory():
    """Ten streams, each step's seed next to the last's: the hardest case for a counter."""
    draws = np.array([[kernels.uniform(seed, k) for k in range(5000)] for seed in range(10)])
    assert draws.min() >= 0.0 and draws.max() < 1.0
    np.testing.assert_allclose(
        np.quantile(draws, [0.1, 0.25, 0.5, 0.75, 0.9], axis=1).mean(axis=1),
        [0.1, 0.25, 0.5, 0.75, 0.9],
        atol=0.005,
    )
    centred = (draws - 0.5) * np.sqrt(12.0)
    # Standard error of a correlation of n pairs: n^-1/2.
    assert np.abs(np.corrcoef(draws) - np.eye(10)).max() < 5 / np.sqrt(5000)
    for lag in (1, 2, 70):
        pairs = centred[:, lag:] * centred[:, :-lag]
        assert abs(pairs.mean()) < 5 / np.sqrt(pairs.size)
