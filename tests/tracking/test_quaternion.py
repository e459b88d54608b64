import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.tracking import quaternion


def wxyz(rotation: Rotation) -> np.ndarray:
    return rotation.as_quat(scalar_first=True)


@pytest.fixture(params=["numpy", "torch"])
def xp(request):
    if request.param == "torch":
        torch = pytest.importorskip("torch")
        return torch.as_tensor
    return np.asarray


@pytest.fixture
def rotations():
    return Rotation.random(20, random_state=0), Rotation.random(20, random_state=1)


def same(q, rotation) -> None:
    assert np.abs(np.sum(np.asarray(q) * wxyz(rotation), axis=-1)) == pytest.approx(1.0, abs=1e-12)


def test_products(xp, rotations):
    a, b = rotations
    qa, qb = xp(wxyz(a)), xp(wxyz(b))
    same(quaternion.multiply(qa, qb), a * b)
    same(quaternion.multiply_conjugate(qa, qb), a * b.inv())
    same(quaternion.conjugate_multiply(qa, qb), a.inv() * b)
    same(quaternion.conjugate(qa), a.inv())


def test_product_is_hamiltons_sign_included():
    i, j, k = np.eye(4)[1:]
    np.testing.assert_array_equal(quaternion.multiply(i, j), k)
    np.testing.assert_array_equal(quaternion.multiply(j, i), -k)
    np.testing.assert_array_equal(quaternion.multiply(i, i), [-1, 0, 0, 0])


def test_matrices_and_rotated_vectors(xp, rotations):
    a, _ = rotations
    q, v = xp(wxyz(a)), np.random.default_rng(0).normal(size=(20, 3))
    np.testing.assert_allclose(quaternion.matrix(q), a.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(quaternion.rotate(q, xp(v)), a.apply(v), atol=1e-13)
    np.testing.assert_allclose(quaternion.rotate_inverse(q, xp(v)), a.inv().apply(v), atol=1e-13)


def test_rot6d_is_the_first_two_columns_by_rows(xp, rotations):
    a, _ = rotations
    expected = a.as_matrix()[:, :, :2].reshape(20, 6)
    np.testing.assert_allclose(quaternion.rot6d(xp(wxyz(a))), expected, atol=1e-14)


def test_angle_is_geodesic_and_blind_to_the_sign(xp, rotations):
    a, b = rotations
    qa, qb = xp(wxyz(a)), xp(wxyz(b))
    expected = (a * b.inv()).magnitude()
    np.testing.assert_allclose(quaternion.angle(qa, qb), expected, atol=1e-7)
    np.testing.assert_allclose(quaternion.angle(-qa, qb), expected, atol=1e-7)


def test_yaw_only_keeps_the_heading(xp):
    rpy = np.random.default_rng(0).uniform(-1.2, 1.2, (30, 3))
    yaw = quaternion.yaw_only(quaternion.from_euler(xp(rpy)))
    same(yaw, Rotation.from_euler("z", rpy[:, 2:]))


def test_from_euler(xp):
    rpy = np.random.default_rng(0).uniform(-2, 2, (30, 3))
    same(quaternion.from_euler(xp(rpy)), Rotation.from_euler("xyz", rpy))


def test_projected_gravity_z(rotations):
    a, _ = rotations
    expected = a.inv().apply([0.0, 0.0, -1.0])[:, 2]
    np.testing.assert_allclose(quaternion.projected_gravity_z(wxyz(a)), expected, atol=1e-14)
