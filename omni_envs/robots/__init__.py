"""What a robot is: frozen descriptions with their MJCF files."""

from omni_envs.robots.g1 import G1
from omni_envs.robots.registry import get_robot, register_robot, robot_names
from omni_envs.robots.robot import (
    CONTACT_LINKS,
    KEYPOINTS,
    SIDES,
    Actuator,
    BodyPoint,
    Foot,
    Robot,
)

__all__ = [
    "CONTACT_LINKS",
    "G1",
    "KEYPOINTS",
    "SIDES",
    "Actuator",
    "BodyPoint",
    "Foot",
    "Robot",
    "get_robot",
    "register_robot",
    "robot_names",
]
