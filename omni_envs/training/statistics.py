"""Statistics of success."""

from __future__ import annotations

from math import sqrt

from omni_envs.errors import InvalidOptionError

Z95 = 1.959963984540054
"""97.5 % quantile of the standard normal distribution."""


def wilson_interval(successes: int, trials: int, z: float = Z95) -> tuple[float, float]:
    """Confidence interval of a success rate (Wilson 1927), sound near 0 and 1 and for few trials.

    Args:
        successes: Number of successes.
        trials: Number of trials.
        z: Quantile of the normal distribution; the default gives 95 %.

    Returns:
        Lower and upper bound.

    Raises:
        InvalidOptionError: There are no trials, or more successes than trials.
    """
    if trials < 1 or not 0 <= successes <= trials:
        raise InvalidOptionError(
            f"wilson_interval: 0 ≤ successes ≤ trials and trials ≥ 1; got {successes} of {trials}."
        )
    rate = successes / trials
    shrink = 1.0 + z**2 / trials
    centre = (rate + z**2 / (2 * trials)) / shrink
    half = z * sqrt(rate * (1.0 - rate) / trials + z**2 / (4 * trials**2)) / shrink
    return max(0.0, centre - half), min(1.0, centre + half)
