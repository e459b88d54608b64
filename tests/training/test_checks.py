from dataclasses import dataclass
from math import inf, nan

import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.training.checks import known, positive, whole_number, within


@pytest.mark.parametrize("value", [1, 0.5, 1e-300, 10**20])
def test_what_is_positive_passes(value):
    positive("Owner", "field", value)


@pytest.mark.parametrize("value", [0, -1, inf, -inf, nan, True, "1", None, [1]])
def test_what_is_not_positive_is_named(value):
    with pytest.raises(InvalidOptionError, match=r"Owner: field must be positive; got .+\.$"):
        positive("Owner", "field", value)


def test_limits_belong_to_a_range():
    for value in (0, 0.0, 0.5, 1, 1.0):
        within("Owner", "field", value, "from 0 to 1", 0.0, 1.0)
    within("Owner", "field", 10**9, "0 or more", 0.0)


@pytest.mark.parametrize("value", [-1e-12, 1.0 + 1e-12, inf, nan, False, "0.5", None])
def test_what_is_outside_a_range_is_told_what_it_may_be(value):
    with pytest.raises(InvalidOptionError, match=r"Owner: field must be from 0 to 1; got "):
        within("Owner", "field", value, "from 0 to 1", 0.0, 1.0)


def test_no_end_is_not_infinity():
    with pytest.raises(InvalidOptionError, match="must be 0 or more; got inf"):
        within("Owner", "field", inf, "0 or more", 0.0)


@pytest.mark.parametrize(
    ("value", "good"), [(1, True), (7, True), (0, False), (2.0, False), (True, False), ("2", False)]
)
def test_whole_numbers_are_no_fractions_and_no_truths(value, good):
    assert whole_number(value, 1) is good
    if good:
        within("Owner", "field", value, "a count", 1, whole=True)
    else:
        with pytest.raises(InvalidOptionError, match="Owner: field must be a count"):
            within("Owner", "field", value, "a count", 1, whole=True)


@dataclass
class _Settings:
    width: int = 1
    height: int = 1


def test_unknown_keys_are_all_named_beside_the_valid_ones():
    known("Owner", {"height": 2}, _Settings)
    with pytest.raises(
        InvalidOptionError, match=r"Owner: unknown \['depth', 'heigth'\]. Valid: height, width\."
    ):
        known("Owner", {"heigth": 2, "depth": 3, "width": 1}, _Settings)
