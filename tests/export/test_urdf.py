import mujoco
import numpy as np
import pytest

from omni_envs.export.urdf import robot_urdf
from omni_envs.robots import get_robot, robot_names


@pytest.mark.parametrize("name", robot_names())
def test_kinematics_masses_and_limits_are_the_models(name):
    """Read by MuJoCo's own URDF parser, which holds the root link in place."""
    robot = get_robot(name)
    ours, spec = robot.model, mujoco.MjSpec.from_string(robot_urdf(robot))
    spec.compiler.fusestatic = False
    theirs = spec.compile()
    assert [theirs.joint(j).name for j in range(theirs.njnt)] == list(robot.joint_names)
    np.testing.assert_allclose(theirs.jnt_range, robot.joint_ranges)
    a, b = mujoco.MjData(ours), mujoco.MjData(theirs)
    a.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    low, high = robot.joint_ranges.T
    a.qpos[7:] = np.random.default_rng(0).uniform(low, high)
    b.qpos[:] = a.qpos[7:]
    mujoco.mj_forward(ours, a)
    mujoco.mj_forward(theirs, b)
    for body in robot.body_names[1:]:
        one, two = a.body(body), b.body(body)
        np.testing.assert_allclose(one.xpos, two.xpos, atol=1e-9)
        np.testing.assert_allclose(one.xmat, two.xmat, atol=1e-9)
        np.testing.assert_allclose(one.xipos, two.xipos, atol=1e-9)
        assert theirs.body(body).mass == pytest.approx(ours.body(body).mass)
        np.testing.assert_allclose(
            np.sort(theirs.body(body).inertia), np.sort(ours.body(body).inertia), rtol=1e-6
        )
