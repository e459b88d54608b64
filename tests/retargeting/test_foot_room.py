import numpy as np
import pytest

from omni_envs.retargeting.foot_room import make_room

LENGTHS = np.full(2, 0.2)


def room(tips, headings, pairs=((0, 1),), width=0.06):
    return make_room(np.array(tips, float), np.array(headings, float), LENGTHS, width, pairs)


def lines(tips, headings, width=0.06):
    """Points on the middle lines of the soles."""
    forward = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    back = np.linspace(0.5 * width, 0.2 - 0.5 * width, 400)
    return tips[:, None] - back[:, None] * forward[:, None]


def least_distance(tips, headings):
    first, second = lines(tips, headings)
    return np.linalg.norm(first[:, None] - second, axis=2).min()


def test_feet_with_room_stay():
    tips = [[0.0, 0.1], [0.0, -0.1]]
    np.testing.assert_array_equal(room(tips, [0.0, 0.0]), tips)
    # So do overlapping ones that do not stand at the same time.
    np.testing.assert_array_equal(room([[0.0, 0.0]] * 2, [0.0, 0.0], pairs=()), [[0.0, 0.0]] * 2)


def test_parallel_feet_are_moved_apart_by_the_same_way():
    np.testing.assert_allclose(
        room([[0.0, 0.02], [0.05, -0.02]], [0.0, 0.0]), [[0.0, 0.03], [0.05, -0.03]], atol=1e-4
    )


@pytest.mark.parametrize(
    ("tips", "headings"),
    [
        ([[0.0, 0.06], [0.0, -0.06]], [0.6, -0.6]),  # heels apart, toes in
        ([[0.0, 0.1], [0.0, -0.1]], [0.7, -0.7]),  # toes out: the heels meet
        ([[0.1, 0.0], [0.02, 0.1]], [0.0, np.pi / 2]),  # crossed
        ([[0.0, 0.0], [0.0, 0.0]], [0.0, 0.0]),  # in the same place
    ],
)
def test_soles_end_up_beside_each_other(tips, headings):
    after = room(tips, headings)
    if np.ptp(tips, axis=0).any():
        assert least_distance(np.array(tips), np.array(headings)) < 0.06
        assert least_distance(after, np.array(headings)) >= 0.059
    np.testing.assert_allclose(after.mean(axis=0), np.mean(tips, axis=0), atol=1e-12)
