"""The model on which distances between a robot and its surroundings are measured."""

from __future__ import annotations

import mujoco

from omni_envs.robots import Robot
from omni_envs.robots.self_collision import resting_pairs
from omni_envs.scenes.build import OBJECT, build_spec
from omni_envs.scenes.scene import Scene


def distance_spec(
    robot: Robot, scene: Scene, contact_distance: float, self_distance: float
) -> mujoco.MjSpec:
    """Builds robot and scene with one contact per pair of geoms, at its exact distance.

    Pairs that touch at rest (``robots.self_collision``) are left out.

    Args:
        robot: The robot.
        scene: Its surroundings.
        contact_distance: Contacts with the surroundings closer than this are found, m.
        self_distance: Contacts between robot bodies closer than this are found, m.
    """
    spec = build_spec(robot, scene, looks=False)
    # MuJoCo adds the margins of a pair. Environment geoms carry what robot geoms do not.
    for geom in spec.geoms:
        own = 0.5 * self_distance
        surroundings = geom.parent.name in ("world", OBJECT)
        geom.margin = contact_distance - own if surroundings else own
    # Several contacts of a pair with a mesh come with distances that are up to 6 mm too large.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)
    for first, second in resting_pairs(robot):
        spec.add_exclude(bodyname1=first, bodyname2=second)
    return spec
