import numpy as np
import pytest

from omni_envs.tracking import quaternion, terminations
from omni_envs.tracking.alignment import Bodies


def test_only_height_counts():
    reference = np.zeros((4, 3))
    position = np.array([[9, 9, 0.24], [0, 0, 0.26], [0, 0, -0.26], [0, 0, 0]])
    assert terminations.height_lost(position, reference, 0.25).tolist() == [
        False,
        True,
        True,
        False,
    ]


@pytest.mark.parametrize(("degrees", "lost"), [(78, False), (79, True)])
def test_tilt_threshold_is_about_gravity_not_an_angle(degrees, lost):
    # 1 - cos(78.46°) = 0.8.
    pitch = np.array([[0.0, np.deg2rad(degrees), 1.0]])
    upright = np.array([[1.0, 0, 0, 0]])
    tilted = quaternion.from_euler(pitch)
    assert terminations.tilt_lost(tilted, upright, 0.8).tolist() == [lost]


def test_heading_does_not_tilt():
    turned = quaternion.from_euler(np.array([[0.0, 0.0, 3.0]]))
    assert not terminations.tilt_lost(turned, np.array([[1.0, 0, 0, 0]]), 1e-9).any()


def test_any_end_effector():
    position = np.zeros((3, 5, 3))
    robot = Bodies(position.copy(), *[np.zeros(0)] * 3)
    robot.position[1, 4, 2] = 0.3
    robot.position[2, 0, 2] = 0.3  # not an end effector
    reference = Bodies(position, *[np.zeros(0)] * 3)
    lost = terminations.any_height_lost(robot, reference, np.array([2, 4]), 0.25)
    assert lost.tolist() == [False, True, False]


def test_object_is_lost_by_distance_or_by_angle():
    lost = terminations.object_lost(
        np.array([0.9, 1.1, 0.0, 0.0]) ** 2,
        np.deg2rad([0, 0, 44, 46]) ** 2,
        distance=1.0,
        angle=np.pi / 4,
    )
    assert lost.tolist() == [False, True, False, True]
