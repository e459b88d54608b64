import clarabel
import numpy as np
import pytest
import scipy.sparse as sparse

from omni_envs.retargeting import retarget
from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.clip_qp import ClipQP
from omni_envs.retargeting.interior_point import solve_clip_qp
from omni_envs.robots import G1


def solve_with_clarabel(qp: ClipQP, hessian: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """The same program in its general sparse form, soft constraints by slack variables."""
    lower, upper, compliance = qp.limits()
    soft = np.flatnonzero(compliance)
    give = np.zeros((len(lower), len(soft)))
    give[soft, np.arange(len(soft))] = 1.0
    full = np.hstack([matrix, give])
    below, above = np.isfinite(lower), np.isfinite(upper)
    rows = sparse.csc_matrix(np.vstack([-full[below], full[above]]))
    bounds = np.concatenate([-lower[below], upper[above]])
    P = sparse.triu(sparse.block_diag([hessian, np.diag(1.0 / compliance[soft])])).tocsc()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    linear = np.concatenate([qp.g.ravel(), np.zeros(len(soft))])
    cones = [clarabel.NonnegativeConeT(len(bounds))]
    solution = clarabel.DefaultSolver(P, linear, rows, bounds, cones, settings).solve()
    return np.array(solution.x)[: qp.g.size].reshape(qp.g.shape)


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_a_general_solver(make_clip_qp, dense_clip_qp, seed):
    qp = make_clip_qp(frames=12, seed=seed)
    ours, theirs = solve_clip_qp(qp, 1e-10), solve_with_clarabel(qp, *dense_clip_qp(qp))
    assert ours.gap <= 1e-10 and ours.residual <= 1e-9
    np.testing.assert_allclose(ours.x, theirs, atol=1e-5)
    assert qp.cost(ours.x) == pytest.approx(qp.cost(theirs), rel=1e-6)


def test_hard_limits_hold_and_bind(make_clip_qp):
    qp = make_clip_qp(frames=20, seed=5)
    x = solve_clip_qp(qp, 1e-8).x
    assert (x >= qp.box.lower).all() and (x <= qp.box.upper).all()
    change = np.diff(x, axis=0)
    assert (change >= qp.change.lower - 1e-9).all() and (change <= qp.change.upper + 1e-9).all()
    assert (np.abs(np.abs(x) - qp.box.upper) < 1e-6).any()
    assert (np.abs(np.abs(change) - qp.change.upper) < 1e-6).any()


def test_contradictions_are_shared_by_stiffness(make_clip_qp):
    qp = make_clip_qp(frames=3, n=2, rows=2, pairs=0)
    qp.g[:] = 0.0
    qp.A[:] = [[1.0, 0.0], [-1.0, 0.0]]
    qp.box.lower[:], qp.box.upper[:] = -1.0, 1.0
    qp.change.lower[:], qp.change.upper[:] = -np.inf, np.inf
    qp.rows.lower[:] = [0.5, -0.3]  # x ≥ 0.5 and x ≤ 0.3
    qp.rows.stiffness[:] = [3e6, 1e6]
    x = solve_clip_qp(qp, 1e-9).x
    np.testing.assert_allclose(x[:, 0], 0.45, atol=1e-4)


def test_without_active_constraints_it_is_a_linear_solve(make_clip_qp, dense_clip_qp):
    qp = make_clip_qp(frames=6)
    for band in (qp.box, qp.change, qp.rows, qp.pairs):
        band.lower[:], band.upper[:] = -np.inf, np.inf
    hessian, _ = dense_clip_qp(qp)
    expected = np.linalg.solve(hessian, -qp.g.ravel())
    np.testing.assert_allclose(solve_clip_qp(qp, 1e-10).x.ravel(), expected, atol=1e-9)


def test_agrees_on_real_frames(grasp, cut, dense_clip_qp):
    motion = retarget(cut(grasp, 10, 18), G1)
    program = ClipProgram(motion.source, G1, motion.options, 5e-6, motion.qpos)
    qp = program.linearise(motion.qpos, 0, motion.num_frames, 0.05)
    ours, theirs = solve_clip_qp(qp, 1e-10), solve_with_clarabel(qp, *dense_clip_qp(qp))
    assert ours.residual <= 1e-9
    assert qp.cost(ours.x) == pytest.approx(qp.cost(theirs), rel=1e-5)
    np.testing.assert_allclose(ours.x, theirs, atol=5e-4)
    # The tolerance that refinement uses is as good for smoothness.
    coarse = solve_clip_qp(qp, 1e-5)
    assert qp.cost(coarse.x) == pytest.approx(qp.cost(ours.x), rel=0.05)
