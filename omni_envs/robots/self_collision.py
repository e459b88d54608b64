"""Which bodies of a robot may touch: those that do at rest."""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np

from omni_envs.robots.robot import Robot

REST_CLEARANCE = 0.005
"""Bodies closer than this in a rest pose are neighbours by construction, not in collision (m)."""


@cache
def resting_pairs(robot: Robot) -> frozenset[tuple[str, str]]:
    """Returns the pairs of bodies that are closer than ``REST_CLEARANCE`` at rest.

    Rest is the default pose and the zero pose. Neither the retargeter nor the metrics count these
    pairs as self-collision. Parent and child bodies never collide in MuJoCo and need no entry.

    Args:
        robot: The robot.

    Returns:
        Pairs of body names, each in model order.
    """
    spec = robot.spec()
    for geom in spec.geoms:
        if geom.group in (2, 5):  # looks, and what collides in physics only: see ``Robot.mjcf``
            geom.contype = geom.conaffinity = 0
        else:
            geom.contype = geom.conaffinity = 1
            geom.margin = REST_CLEARANCE  # summed over a pair; the distance decides below
    model = spec.compile()
    data = mujoco.MjData(model)
    pairs: set[tuple[str, str]] = set()
    for joints in (robot.default_joint_array, np.zeros(robot.num_joints)):
        data.qpos[:3], data.qpos[3:7], data.qpos[7:] = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0), joints
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        close = data.contact.geom[data.contact.dist < REST_CLEARANCE]
        for bodies in np.sort(model.geom_bodyid[close], axis=1).reshape(-1, 2):
            pairs.add((model.body(bodies[0]).name, model.body(bodies[1]).name))
    return frozenset(pairs)
