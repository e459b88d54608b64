import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from omni_envs.envs.options import (
    UnexpectedOptionError,
    autoreset_mode_of,
    check_whole,
    merged_seed,
    refuse_unknown,
)
from omni_envs.errors import InvalidOptionError, UnknownNameError


class Owner:
    def __init__(self, reward=None, reference=None, **unknown):
        refuse_unknown(Owner, unknown)


def test_an_unknown_keyword_is_a_type_error_that_names_the_valid_ones():
    message = (
        r"Owner\.__init__\(\) got .*'rewrd'\. Did you mean 'reward'\? Valid: reference, reward\."
    )
    with pytest.raises(UnexpectedOptionError, match=message):
        Owner(rewrd=1)
    with pytest.raises(TypeError, match="Valid: reference"):
        Owner(zzz=1)


def test_autoreset_modes_by_name_or_member():
    assert autoreset_mode_of("same_step") is AutoresetMode.SAME_STEP
    assert autoreset_mode_of(AutoresetMode.DISABLED) is AutoresetMode.DISABLED
    for mode in (AutoresetMode.NEXT_STEP, 3):
        with pytest.raises(UnknownNameError, match="Valid: DISABLED, SAME_STEP"):
            autoreset_mode_of(mode)


@pytest.mark.parametrize("value", [1, 7, np.int64(3)])
def test_whole_numbers_pass(value):
    check_whole("count", value, 1)


@pytest.mark.parametrize("value", [1.5, 2.0, "8", True, None, np.float64(2), [2]])
def test_what_is_no_whole_number_is_named(value):
    with pytest.raises(InvalidOptionError, match="count must be a whole number; got "):
        check_whole("count", value, 1)


def test_whole_numbers_below_the_least_are_named():
    with pytest.raises(InvalidOptionError, match=r"count must be at least 1; got 0\."):
        check_whole("count", 0, 1)


def test_a_seed_is_its_own_and_a_list_makes_one_that_depends_on_all():
    assert merged_seed(5, 3) == merged_seed(np.int64(5), 3) == 5
    seeds = [[1, 2, 3], [1, 2, 4], [3, 2, 1], [None, 2, 3]]
    assert len({merged_seed(s, 3) for s in seeds}) == 4
    assert (
        merged_seed((1, 2, 3), 3) == merged_seed(np.array([1, 2, 3]), 3) == merged_seed(seeds[0], 3)
    )


def test_a_list_of_no_seeds_is_none():
    assert merged_seed([None, None], 2) is None


@pytest.mark.parametrize("seed", [-1, 1.5, "a", [1, 2], [1, 2, 3, 4], [1, 2, -3], [1.5, 2, 3], {}])
def test_other_seeds_are_refused(seed):
    with pytest.raises(InvalidOptionError, match="one for each of the 3 simulations; got "):
        merged_seed(seed, 3)
