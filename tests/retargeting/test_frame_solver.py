"""One frame: it converges, to the same place from every side."""

import pytest

from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.first_frame import aligned_poses
from omni_envs.retargeting.frame_solver import FrameSolver
from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.interaction_mesh_task import InteractionMeshTask
from omni_envs.retargeting.joint_limits import JointLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.robots import G1


@pytest.fixture
def frame(grasp):
    configuration = Kinematics(G1, grasp.scene)
    mesh = InteractionMeshTask(InteractionMesh.of(grasp), 10.0)
    configuration.place_object(grasp.object_poses[0])
    limits = [JointLimit(G1)], [ContactLimit(0.0)]
    solver = FrameSolver(configuration, [mesh], *limits, solve_daqp, RetargetOptions())
    return solver, aligned_poses(configuration, grasp.keypoints[0])[0]


def test_steps_that_undo_each_other_end(frame):
    """Without smoothness the wrists hardly matter: full steps would throw them to and fro."""
    solver, start = frame
    result = solver.solve(start, 50, 0.2, 1e-6)
    energy = solver.tasks[0].energy(solver.configuration)
    assert result.iterations < 40 and max(result.violations) <= 2e-5
    solver.solve(result.q, 50, 0.2, 1e-6)
    assert solver.tasks[0].energy(solver.configuration) == pytest.approx(energy, rel=1e-3)


def test_one_step_suffices_at_the_solution(frame):
    solver, start = frame
    q = solver.solve(start, 50, 0.2, 1e-6).q
    assert solver.solve(q, 50, 0.2, 1e-3).iterations <= 2


def test_without_restoration_no_violation_is_claimed(frame):
    solver, start = frame
    result = solver.solve(start, 2, 0.2, 1e-3, restore=False)
    assert result.iterations == 2 and result.violations == (0.0, 0.0, 0.0)
