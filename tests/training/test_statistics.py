import pytest
from scipy.stats import binomtest

from omni_envs.errors import InvalidOptionError
from omni_envs.training.statistics import wilson_interval


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (7, 10), (10, 10), (160, 200), (1, 1)])
def test_agrees_with_scipy(successes, trials):
    expected = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    assert wilson_interval(successes, trials) == pytest.approx((expected.low, expected.high))


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (3, 2), (-1, 4)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(InvalidOptionError, match=f"got {successes} of {trials}"):
        wilson_interval(successes, trials)
