import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.tracking import quaternion
from omni_envs.tracking.alignment import align
from omni_envs.tracking.rewards import mean_squared_distance

N, B = 7, 5


@pytest.fixture
def reference():
    rng = np.random.default_rng(0)
    position = rng.normal(size=(N, B, 3))
    return position, Rotation.random(N * B, random_state=2).as_quat(scalar_first=True).reshape(
        N, B, 4
    )


def drift(position, q, offset, yaw):
    turn = np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
    turn = np.broadcast_to(turn, q.shape)
    return quaternion.rotate(turn, position) + offset, quaternion.multiply(turn, q)


def test_drift_in_x_y_and_yaw_is_forgiven(reference):
    position, q = reference
    moved, turned = drift(position, q, np.array([2.0, -3.0, 0.0]), 2.5)
    a = align(moved[:, 1], turned[:, 1], position[:, 1], q[:, 1])
    np.testing.assert_allclose(a.positions(position), moved, atol=1e-12)
    assert mean_squared_distance(moved, a.positions(position)) == pytest.approx(0, abs=1e-20)
    np.testing.assert_allclose(a.angle(turned, q), 0, atol=1e-7)


def test_height_is_not_forgiven(reference):
    position, q = reference
    moved, turned = drift(position, q, np.array([2.0, -3.0, 0.1]), 2.5)
    a = align(moved[:, 0], turned[:, 0], position[:, 0], q[:, 0])
    assert mean_squared_distance(moved, a.positions(position)) == pytest.approx(0.01)


def test_the_angle_needs_no_re_aligned_orientations(reference):
    position, q = reference
    robot_q = Rotation.random(N * B, random_state=9).as_quat(scalar_first=True).reshape(N, B, 4)
    a = align(position[:, 0], robot_q[:, 0], position[:, 0], q[:, 0])
    np.testing.assert_allclose(
        a.angle(robot_q, q), quaternion.angle(robot_q, a.quaternions(q)), atol=1e-7
    )


def test_formula_of_beyondmimic(reference):
    position, q = reference
    robot, robot_q = position[::-1].copy(), q[::-1].copy()
    a = align(robot[:, 2], robot_q[:, 2], position[:, 2], q[:, 2])
    delta = quaternion.yaw_only(quaternion.multiply(robot_q[:, 2], quaternion.conjugate(q[:, 2])))[
        :, None
    ]
    origin = np.stack([robot[:, 2, 0], robot[:, 2, 1], position[:, 2, 2]], -1)
    expected = origin[:, None] + quaternion.rotate(delta, position - position[:, 2:3])
    np.testing.assert_allclose(a.positions(position), expected, atol=1e-12)
    np.testing.assert_allclose(a.quaternions(q), quaternion.multiply(delta, q), atol=1e-12)
