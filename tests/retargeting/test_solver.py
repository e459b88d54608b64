"""DAQP, Clarabel and mink solve the same steps of real frames."""

import mink
import numpy as np
import pytest
import qpsolvers

from omni_envs.retargeting import InteractionMesh, RetargetOptions, retarget
from omni_envs.retargeting.clarabel_solver import solve_clarabel
from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.interaction_mesh_task import InteractionMeshTask
from omni_envs.retargeting.joint_limits import JointLimit, StepVelocityLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, SELF, STANCE, Rows
from omni_envs.retargeting.proximal_task import ProximalTask
from omni_envs.retargeting.qp import StepQP, step_bounds, step_model, step_rows
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.robots import G1


@pytest.fixture(scope="module")
def solved(grasp):
    return retarget(grasp, G1)


def parts(source, solved, t):
    """Tasks and limits of frame t about the solution of frame t - 1."""
    configuration = Kinematics(G1, source.scene)
    configuration.place_object(source.object_poses[t])
    configuration.update(solved.qpos[t - 1])
    mesh = InteractionMeshTask(InteractionMesh.of(source), 10.0)
    mesh.set_frame(t)
    near = ProximalTask(0.2 * configuration.metric)
    near.set_target(solved.qpos[t - 1])
    speed = StepVelocityLimit(G1, source.fps, 1.0)
    speed.set_previous(solved.qpos[t - 1])
    return configuration, [mesh, near], [JointLimit(G1), speed], [ContactLimit(0.0)]


def program(source, solved, t, radius):
    configuration, tasks, bounds, limits = parts(source, solved, t)
    H, g = step_model(configuration, tasks)[:2]
    lower, upper = step_bounds(configuration, bounds)
    rows = step_rows(configuration, limits)
    return StepQP(H, g, lower, upper, rows, configuration.metric, radius)


@pytest.mark.parametrize("t", [5, 25, 50])
@pytest.mark.parametrize("radius", [np.inf, 0.03, 0.015])
def test_daqp_and_the_cone_agree(grasp, solved, t, radius):
    qp = program(grasp, solved, t, radius)
    ours, soft = solve_daqp(qp)
    cone, cone_soft = solve_clarabel(qp)
    assert soft == cone_soft
    assert qp.norm(ours) <= 1.006 * radius
    if soft:  # the moving box asks for more than the radius allows
        return
    np.testing.assert_allclose(ours, cone, atol=5e-4)
    assert qp.decrease(ours) == pytest.approx(qp.decrease(cone), rel=5e-3, abs=1e-7)


def test_mink_builds_the_same_program(grasp, solved):
    configuration, tasks, bounds, limits = parts(grasp, solved, 30)
    built = mink.build_ik(configuration, tasks, 1.0, 0.0, [*bounds, *limits])
    expected = qpsolvers.solve_problem(built, solver="daqp").x
    ours, _ = solve_daqp(program(grasp, solved, 30, np.inf))
    np.testing.assert_allclose(ours, expected, atol=1e-5)


def test_contradicting_rows_give_way_in_order():
    # The same coordinate is asked to be above 1 by contact and below 0 by stance, self at 0.5.
    A = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    rows = Rows(
        A,
        np.array([1.0, -np.inf, -np.inf]),
        np.array([np.inf, 0.0, 0.5]),
        np.array([CONTACT, STANCE, SELF]),
    )
    qp = StepQP(np.eye(2), np.zeros(2), np.full(2, -5.0), np.full(2, 5.0), rows, np.ones(2), np.inf)
    for solve in (solve_daqp, solve_clarabel):
        dq, soft = solve(qp)
        assert soft
        # Contact all but holds, the others pay.
        assert dq[0] == pytest.approx(0.95, abs=0.05)


def test_bounds_hold_whatever_rows_ask():
    rows = Rows(np.array([[1.0]]), np.array([9.0]), np.array([np.inf]), np.array([CONTACT]))
    qp = StepQP(np.eye(1), np.zeros(1), -np.ones(1), np.ones(1), rows, np.ones(1), np.inf)
    for solve in (solve_daqp, solve_clarabel):
        dq, soft = solve(qp)
        assert soft and dq[0] <= 1.0 and dq[0] == pytest.approx(1.0, abs=1e-3)


def test_clip_solved_with_the_cone_has_the_same_energy(grasp, cut):
    part = cut(grasp, 0, 12)
    cone = retarget(part, G1, RetargetOptions(solver="clarabel"))
    ours = retarget(part, G1)
    np.testing.assert_allclose(cone.frames.energy, ours.frames.energy, rtol=0.02)
