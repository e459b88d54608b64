"""The compiled loops are the formulas they are documented with."""

import numpy as np
import pytest

from omni_envs.retargeting import kernels

rng = np.random.default_rng(0)


def sparse(*shape):
    return rng.normal(size=shape) * (rng.random(shape) < 0.4)


def test_coupled_squares():
    J, half, force = sparse(3, 5, 8), sparse(5, 5), rng.normal(size=(5, 3))
    M = half @ half.T
    H, g = kernels.coupled_squares(J, M, force)
    np.testing.assert_allclose(H, sum(J[d].T @ M @ J[d] for d in range(3)), atol=1e-12)
    np.testing.assert_allclose(g, sum(J[d].T @ force[:, d] for d in range(3)), atol=1e-12)
    np.testing.assert_array_equal(H, H.T)


def test_weighted_squares():
    J, r, w = sparse(6, 8), rng.normal(size=6), rng.random(6)
    H, g, value = kernels.weighted_squares(J, r, w)
    np.testing.assert_allclose(H, J.T @ np.diag(w) @ J, atol=1e-12)
    np.testing.assert_allclose(g, J.T @ (w * r), atol=1e-12)
    assert value == pytest.approx(0.5 * w @ r**2)


def test_worst_violations_by_kind():
    lower, upper = np.array([-1.0, 0.5, -2.0, 0.1]), np.array([1.0, 2.0, -0.3, np.inf])
    worst = kernels.worst_violations(lower, upper, np.array([0, 2, 2, 2]), 3)
    np.testing.assert_array_equal(worst, [0.0, 0.0, 0.5])


def test_contact_sides():
    moves = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    geom_bodies = np.array([0, 1, 2, 2], np.int32)
    geoms, distances = np.array([[0, 2], [1, 3]], np.int32), np.array([-0.01, 0.02])
    bodies, own, lower = kernels.contact_sides(geoms, geom_bodies, distances, moves, 0.001)
    np.testing.assert_array_equal(bodies, [[0, 2], [1, 2]])
    np.testing.assert_array_equal(own, [False, True])
    np.testing.assert_allclose(lower, [0.009, -0.02])


def test_selected_squares():
    select, values, jacobian = rng.normal(size=(4, 6)), rng.normal(size=6), rng.normal(size=(6, 5))
    select[rng.random(select.shape) < 0.5] = 0.0
    targets, weights = rng.normal(size=4), rng.uniform(1.0, 2.0, 4)
    H, g, value = kernels.selected_squares(select, values, jacobian, targets, weights)
    rows, error = select @ jacobian, select @ values - targets
    np.testing.assert_allclose(H, rows.T @ (weights[:, None] * rows), atol=1e-12)
    np.testing.assert_allclose(g, rows.T @ (weights * error), atol=1e-12)
    assert value == pytest.approx(0.5 * weights @ error**2)


def test_lowest_points():
    points, normals = rng.normal(size=(2, 7, 3)), rng.normal(size=(2, 3))
    heights, lowest = kernels.lowest_points(points, normals)
    expected = np.einsum("fkd,fd->fk", points, normals)
    np.testing.assert_allclose(heights, expected.min(axis=1))
    np.testing.assert_array_equal(lowest, points[[0, 1], expected.argmin(axis=1)])


def test_farthest_points():
    points, stretch = rng.normal(size=(40, 3)), rng.uniform(1.0, 2.0, 40)
    chosen = kernels.farthest_points(points, stretch, 12).tolist()
    assert chosen[0] == 0 and len(set(chosen)) == 12
    for i in range(1, 12):
        apart = np.linalg.norm(points[:, None] - points[chosen[:i]], axis=2).min(axis=1) * stretch
        assert apart[chosen[i]] == pytest.approx(apart.max())
