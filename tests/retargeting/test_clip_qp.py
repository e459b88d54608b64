import numpy as np
import pytest
from scipy.linalg.lapack import dpbtrs

from omni_envs.errors import OmniEnvsError


def test_products_are_those_of_the_matrices(make_clip_qp, dense_clip_qp):
    qp = make_clip_qp()
    hessian, matrix = dense_clip_qp(qp)
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=qp.g.shape), rng.normal(size=len(matrix))
    np.testing.assert_allclose(qp.curvature(x).ravel(), hessian @ x.ravel(), atol=1e-12)
    np.testing.assert_allclose(qp.values(x), matrix @ x.ravel(), atol=1e-12)
    np.testing.assert_allclose(qp.forces(y).ravel(), matrix.T @ y, atol=1e-12)
    cost = 0.5 * x.ravel() @ hessian @ x.ravel() + qp.g.ravel() @ x.ravel()
    assert qp.cost(x) == pytest.approx(cost)


@pytest.mark.parametrize(("frames", "pairs"), [(7, 2), (7, 0), (3, 1), (2, 1), (1, 0)])
def test_factor_solves_the_normal_equations(make_clip_qp, dense_clip_qp, frames, pairs):
    qp = make_clip_qp(frames=frames, pairs=pairs)
    hessian, matrix = dense_clip_qp(qp)
    weights = np.random.default_rng(2).uniform(0.0, 10.0, len(matrix))
    weights[::3] = 0.0
    right = np.random.default_rng(3).normal(size=frames * 5)
    factor = qp.factor(weights)
    solution = dpbtrs(factor, right, lower=1)[0]
    expected = np.linalg.solve(hessian + matrix.T @ (weights[:, None] * matrix), right)
    np.testing.assert_allclose(solution, expected, rtol=1e-9, atol=1e-12)


def test_a_cost_without_minimum_is_refused(make_clip_qp):
    qp = make_clip_qp()
    qp.H[3] -= 100.0 * np.eye(5)
    with pytest.raises(OmniEnvsError, match="positive definite"):
        qp.factor(np.zeros(len(qp.limits()[0])))
