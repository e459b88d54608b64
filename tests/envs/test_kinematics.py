from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from omni_envs.envs.kinematics import body_tree
from omni_envs.robots import G1, H1, T1
from omni_envs.tracking import kernels
from omni_envs.tracking.alignment import Bodies

ODD = """
<mujoco><compiler angle="radian"/><worldbody>
  <body name="root" pos="0 0 1"><freejoint/><geom size="0.1"/>
    <body name="fixed" pos="0.1 0 0.2" quat="0.9 0.1 0.3 -0.2"><geom size="0.1"/>
      <body name="ball" pos="0 0.2 0"><geom size="0.1"/>
        <joint axis="1 0 0" pos="0.05 -0.02 0.1" ref="0.4"/><joint axis="0 1 1" pos="0 0.1 0"/>
        <joint axis="0 0 1"/>
        <body name="tip" pos="0 0 0.3" quat="0.5 0.5 -0.5 0.5"><geom size="0.1"/></body>
      </body></body>
    <body name="aside" pos="0 0 -0.3"><joint axis="0 1 0"/><geom size="0.1"/></body>
  </body></worldbody></mujoco>
"""
"""Axes off the origin, several joints on a body, bodies without any, one that nothing tracks."""


@pytest.mark.parametrize("robot", [G1, H1, T1, None], ids=["g1", "h1", "t1", "odd"])
def test_bodies_are_mujocos(robot):
    if robot is None:
        robot = SimpleNamespace(
            model=mujoco.MjModel.from_xml_string(ODD), tracked_bodies=("tip", "root", "ball")
        )
    model, names = robot.model, robot.tracked_bodies
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    qpos, qvel = rng.normal(size=(5, model.nq)), rng.normal(size=(5, model.nv))
    out = Bodies(*(np.full((5, len(names), size), np.nan) for size in (3, 4, 3, 3)))
    kernels.place_bodies(body_tree(robot), qpos, qvel, np.array([0, 2, 4]), out)
    velocity = np.zeros(6)
    for i in range(5):
        if i % 2:
            assert all(np.isnan(part[i]).all() for part in out)
            continue
        data.qpos[:], data.qvel[:] = qpos[i], qvel[i]
        mujoco.mj_forward(model, data)
        for k, name in enumerate(names):
            body = model.body(name).id
            np.testing.assert_allclose(out.position[i, k], data.xpos[body], atol=1e-12)
            np.testing.assert_allclose(out.quaternion[i, k], data.xquat[body], atol=1e-12)
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
            np.testing.assert_allclose(out.angular_velocity[i, k], velocity[:3], atol=1e-11)
            np.testing.assert_allclose(out.linear_velocity[i, k], velocity[3:], atol=1e-11)
