"""The learning rate that follows the KL divergence (Schulman et al. 2017, as in rsl_rl)."""

from __future__ import annotations

MIN_LEARNING_RATE, MAX_LEARNING_RATE = 1e-5, 1e-2


def adapted_learning_rate(rate: float, kl: float, desired: float) -> float:
    """Returns the learning rate of the next gradient step.

    Args:
        rate: That of the last one.
        kl: KL divergence of the policy from the one that acted.
        desired: Divided by 1.5 where the divergence is more than twice this, multiplied where it
            is less than half; 0 keeps the rate.
    """
    if desired and kl > 2.0 * desired:
        return max(MIN_LEARNING_RATE, rate / 1.5)
    if desired and 0.0 < kl < 0.5 * desired:
        return min(MAX_LEARNING_RATE, rate * 1.5)
    return rate
