import numpy as np
import pytest

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.robots import G1, get_robot
from omni_envs.scenes import Scene


@pytest.fixture
def configuration():
    configuration = Kinematics(G1, Scene())
    rng = np.random.default_rng(1)
    q = G1.default_qpos.copy()
    q[7:] += rng.normal(scale=0.2, size=29)
    q[3:7] = [0.5, 0.5, -0.5, 0.5]
    configuration.update(q)
    return configuration


def differentiate(configuration, quantity, step=1e-6):
    q, nv = configuration.data.qpos.copy(), configuration.model.nv
    columns = []
    for i in range(nv):
        dq = np.zeros(nv)
        dq[i] = step
        configuration.update(q)
        ahead = configuration.step(dq)
        behind = configuration.step(-dq)
        configuration.update(ahead)
        high = quantity(configuration).copy()
        configuration.update(behind)
        columns.append((high - quantity(configuration)) / (2 * step))
    configuration.update(q)
    return np.stack(columns, axis=-1)


def test_keypoint_jacobians(configuration):
    expected = differentiate(configuration, Kinematics.keypoints)
    np.testing.assert_allclose(
        np.moveaxis(configuration.keypoint_jacobians(), 0, 1), expected, atol=1e-7
    )


def test_feet_jacobians(configuration):
    expected = differentiate(configuration, Kinematics.feet)
    np.testing.assert_allclose(configuration.feet_jacobians(), expected, atol=1e-7)


def test_toe_height_gradients(configuration):
    normals = np.array([[0.0, 0.0, 1.0], [0.3, 0.1, 0.9]])
    moved = differentiate(configuration, lambda moving: moving.toe_heights(normals))
    np.testing.assert_allclose(configuration.toe_height_gradients(normals), moved, atol=1e-7)


def test_contact_rows_are_relative_jacobians_along_the_normal(configuration):
    bodies = np.array([configuration.model.body(f"left_{n}_link").id for n in ("knee", "elbow")])
    point, normal = np.array([[0.1, 0.2, 0.3]]), np.array([[0.0, 0.6, 0.8]])
    first, second = np.moveaxis(configuration.body_jacobians(bodies, point.repeat(2, axis=0)), 1, 0)
    row = configuration.contact_rows(bodies[None], point, normal)
    np.testing.assert_allclose(row[0], normal[0] @ (second - first), atol=1e-12)
    from_world = configuration.contact_rows(np.array([[0, bodies[1]]]), point, normal)
    np.testing.assert_allclose(from_world[0], normal[0] @ second, atol=1e-12)


def test_heart_of_the_sole_is_behind_the_tip_and_left_is_left(configuration):
    configuration.update(G1.default_qpos)
    feet = configuration.feet()
    assert (feet[:, 1, 0] < -0.05).all()
    np.testing.assert_allclose(feet[:, 2], [[0.0, 0.1, 0.0]] * 2, atol=1e-2)


def test_difference_undoes_step(configuration):
    dq = np.random.default_rng(2).normal(scale=0.1, size=configuration.model.nv)
    np.testing.assert_allclose(configuration.difference(configuration.step(dq)), dq, atol=1e-12)


@pytest.mark.parametrize(("name", "width"), [("g1", 0.062), ("h1", 0.03), ("t1", 0.094)])
def test_foot_width_is_that_of_the_collision_geoms(name, width):
    assert Kinematics(get_robot(name), Scene()).foot_width == pytest.approx(width, abs=1e-3)
