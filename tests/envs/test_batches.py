import numpy as np
import pytest

from omni_envs.envs.batches import real_array
from omni_envs.errors import InvalidDataError


def test_numbers_of_any_kind_become_contiguous_float64():
    for values in ([[1, 2], [3, 4]], np.array([[1, 2], [3, 4]], np.float32), np.ones((2, 2)).T):
        array = real_array("Owner", "action", values)
        assert array.dtype == np.float64 and array.flags.c_contiguous
        np.testing.assert_array_equal(array, values)


@pytest.mark.parametrize("values", ["abc", ["a", "b"], {"a": 1}, [[1, 2], [3]], object()])
def test_what_is_no_array_of_numbers_is_named(values):
    with pytest.raises(InvalidDataError, match="Owner: action must be real numbers; got "):
        real_array("Owner", "action", values)
