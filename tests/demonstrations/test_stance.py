import numpy as np
import pytest

from omni_envs.demonstrations import stance_intervals, stance_schedule
from omni_envs.demonstrations.stance import lying_feet, pivot_schedule
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


def foot(pitch, heading=0.0):
    """(T, 3) vectors from toe to ankle of a foot with these angles, degrees."""
    pitch, heading = np.broadcast_arrays(np.deg2rad(pitch), np.deg2rad(heading))
    level = np.stack([-np.cos(heading), -np.sin(heading)], axis=-1)
    return np.concatenate([np.cos(pitch)[:, None] * level, np.sin(pitch)[:, None]], axis=1)


def test_a_foot_that_keeps_its_direction_does_not_pivot():
    pitch = 25.0 + 6.0 * np.sin(np.arange(90))
    assert not pivot_schedule(foot(pitch), np.ones(90, bool), FPS).any()


@pytest.mark.parametrize("turned", [False, True])
def test_a_roll_or_turn_splits_a_stance_into_parts(turned):
    angle = np.concatenate([np.zeros(40), np.linspace(0, 40, 20), np.full(40, 40.0)])
    directions = foot(20.0, 1.2 * angle) if turned else foot(20.0 + angle)
    pivots = pivot_schedule(directions, np.ones(100, bool), FPS)
    ((start, stop),) = stance_intervals(pivots)
    assert 40 < start < 46 and 56 < stop <= 60  # from 5° on, until 5° before it rests


def test_a_roll_that_does_not_come_to_rest_lasts_to_the_end_of_the_stance():
    pitch = np.concatenate([np.full(30, 20.0), np.linspace(20, 80, 30)])
    stance = np.arange(60) < 55
    pivots = pivot_schedule(foot(pitch), stance, FPS)
    assert stance_intervals(pivots) == [(33, 55)]
    assert not pivot_schedule(foot(pitch), stance & False, FPS).any()


def test_bad_input():
    with pytest.raises(UnknownNameError, match="default"):
        stance_schedule(toe([0.0]), FPS, "defalt")
    with pytest.raises(InvalidDataError, match="toe_positions"):
        stance_schedule(np.zeros((4, 2)), FPS)


def test_a_foot_on_its_heel_lies():
    angles = np.deg2rad([-60.0, 0.0, 20.0, 39.0, 41.0, 90.0])  # of the toes over the ankle
    directions = -np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    np.testing.assert_array_equal(lying_feet(directions), [False] * 4 + [True] * 2)
