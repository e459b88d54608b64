import numpy as np
import pytest

from omni_envs.demonstrations import stance_intervals, stance_schedule
from omni_envs.errors import InvalidDataError, UnknownNameError

FPS = 30.0


def toe(speeds):
    """A toe that steps with these horizontal speeds, m/s, and bobs up and down at will."""
    x = np.concatenate([[0.0], np.cumsum(np.asarray(speeds) / FPS)])
    z = 0.1 * (np.arange(len(x)) % 2)
    return np.stack([0.6 * x, 0.8 * x, z], axis=1)


def test_thresholds_and_first_frame():
    path = toe([0.0, 0.009, 0.02, 0.29, 0.31])
    assert stance_schedule(path, FPS, "text").tolist() == [False, True, True, False, False, False]
    assert stance_schedule(path, FPS, "code").tolist() == [False, True, True, True, True, False]


def test_default_has_hysteresis():
    path = toe([0.12, 0.05, 0.12, 0.14, 0.16, 0.12, 0.12])
    assert stance_schedule(path, FPS).tolist() == [False, False, *[True] * 3, *[False] * 3]


def test_default_drops_short_stances():
    path = toe([0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5])
    stance = stance_schedule(path, FPS)
    assert stance_intervals(stance) == [(5, 8)]


def test_rate_is_respected():
    assert stance_schedule(toe([0.005] * 3), 3 * FPS, "text").tolist() == [False] * 4


def test_intervals():
    assert stance_intervals(np.array([1, 1, 0, 1, 0, 0, 1], bool)) == [(0, 2), (3, 4), (6, 7)]
    assert stance_intervals(np.zeros(3, bool)) == []


def test_bad_input():
    with pytest.raises(UnknownNameError, match="default"):
        stance_schedule(toe([0.0]), FPS, "defalt")
    with pytest.raises(InvalidDataError, match="toe_positions"):
        stance_schedule(np.zeros((4, 2)), FPS)
