import mujoco
import numpy as np
import pytest

from omni_envs import rotations


@pytest.fixture
def quaternions():
    q = np.random.default_rng(0).normal(size=(200, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def matrix(q):
    out = np.empty(9)
    mujoco.mju_quat2Mat(out, q)
    return out.reshape(3, 3)


def test_product_and_rotation_agree_with_mujoco(quaternions):
    a, b = quaternions[:100], quaternions[100:]
    product = rotations.multiply(a, b)
    expected = np.empty(4)
    for i in range(100):
        mujoco.mju_mulQuat(expected, a[i], b[i])
        np.testing.assert_allclose(product[i], expected, atol=1e-12)
        v = np.array([0.3, -1.0, 2.0])
        np.testing.assert_allclose(rotations.rotate(a[i], v), matrix(a[i]) @ v, atol=1e-12)


def test_exp_is_the_inverse_of_log(quaternions):
    back = rotations.exp(rotations.log(quaternions))
    np.testing.assert_allclose(np.abs(np.sum(back * quaternions, axis=1)), 1.0, atol=1e-12)
    assert (np.linalg.norm(rotations.log(quaternions), axis=1) <= np.pi + 1e-12).all()


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-8, 1e-3, 3.1])
def test_small_and_large_angles(angle):
    v = np.array([0.0, angle, 0.0])
    np.testing.assert_allclose(rotations.log(rotations.exp(v)), v, atol=1e-15, rtol=1e-9)


def test_difference_agrees_with_mujoco(quaternions):
    a, b = quaternions[:100], quaternions[100:]
    out = np.empty(3)
    for i in range(100):
        mujoco.mju_subQuat(out, b[i], a[i])
        np.testing.assert_allclose(rotations.difference(a[i], b[i]), out, atol=1e-9)


def test_slerp_takes_the_short_arc_at_constant_speed(quaternions):
    a, b = quaternions[:100], quaternions[100:]
    angle = np.linalg.norm(rotations.difference(a, b), axis=1)
    for weight in (0.0, 0.25, 1.0):
        part = rotations.slerp(a, -b, np.full(100, weight))
        np.testing.assert_allclose(np.linalg.norm(part, axis=1), 1.0, atol=1e-12)
        done = np.linalg.norm(rotations.difference(a, part), axis=1)
        np.testing.assert_allclose(done, weight * angle, atol=1e-9)
