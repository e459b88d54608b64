"""Solving the step with Clarabel: the trust region as a second-order cone."""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from omni_envs.retargeting.qp import StepQP
from omni_envs.retargeting.softness import softness


def solve_clarabel(qp: StepQP) -> tuple[np.ndarray, bool]:
    """Solves a step as one second-order cone program. Never fails: see ``solver.solve_daqp``."""
    dq = _solve(qp, soft=False)
    if dq is not None:
        return dq, False
    dq = _solve(qp, soft=True)
    if dq is None:  # numerical trouble on both: stay, as far as the bounds allow
        dq = np.zeros(len(qp.g))
    return np.clip(dq, qp.lower, qp.upper), True


def _solve(qp: StepQP, soft: bool) -> np.ndarray | None:
    n, m = len(qp.g), len(qp.rows.lower)
    slacks = m if soft else 0
    eye, A = sparse.eye(n), sparse.csc_matrix(qp.rows.A)
    give = sparse.eye(m, slacks)
    empty = sparse.csc_matrix((n, slacks))
    # A dq + s ≥ lower and A dq - s ≤ upper with s ≥ 0.
    blocks = [
        (sparse.hstack([eye, empty]), qp.upper),
        (sparse.hstack([-eye, empty]), -qp.lower),
        (sparse.hstack([A, -give]), qp.rows.upper),
        (sparse.hstack([-A, -give]), -qp.rows.lower),
    ]
    if soft:
        blocks.append((sparse.hstack([sparse.csc_matrix((m, n)), -sparse.eye(m)]), np.zeros(m)))
    G = sparse.vstack([block for block, _ in blocks]).tocsr()
    h = np.concatenate([bound for _, bound in blocks])
    finite = np.isfinite(h)
    G, h = G[finite], h[finite]
    cones = [clarabel.NonnegativeConeT(len(h))]
    if np.isfinite(qp.radius):
        # (ε, S^½ dq) in the cone.
        cone = sparse.vstack([sparse.csc_matrix((1, n)), -sparse.diags(np.sqrt(qp.metric))])
        G = sparse.vstack([G, sparse.hstack([cone, sparse.csc_matrix((n + 1, slacks))])])
        h = np.concatenate([h, [qp.radius], np.zeros(n)])
        cones.append(clarabel.SecondOrderConeT(n + 1))
    quadratic, linear = softness(qp.rows.kind)
    P = sparse.block_diag([sparse.triu(qp.H), sparse.diags(quadratic[:slacks])], format="csc")
    g = np.concatenate([qp.g, linear[:slacks]])
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.presolve_enable, settings.max_threads = False, False, 1
    solution = clarabel.DefaultSolver(P, g, G.tocsc(), h, cones, settings).solve()
    if solution.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        return None
    return np.clip(np.array(solution.x[:n]), qp.lower, qp.upper)
