"""The table of robots, open to robots from outside the package."""

from __future__ import annotations

from omni_envs.errors import InvalidDataError, UnknownNameError
from omni_envs.robots.g1 import G1
from omni_envs.robots.h1 import H1
from omni_envs.robots.robot import Robot
from omni_envs.robots.t1 import T1

_ROBOTS: dict[str, Robot] = {robot.name: robot for robot in (G1, H1, T1)}


def robot_names() -> tuple[str, ...]:
    """Returns the names of all registered robots."""
    return tuple(_ROBOTS)


def get_robot(name: str | Robot) -> Robot:
    """Looks a robot up.

    Args:
        name: A registered name, in any case; a ``Robot`` is returned as it is.

    Raises:
        UnknownNameError: No robot of that name is registered.
    """
    if isinstance(name, Robot):
        return name
    robot = _ROBOTS.get(str(name).lower())
    if robot is None:
        raise UnknownNameError("robot", name, robot_names())
    return robot


def register_robot(robot: Robot) -> Robot:
    """Adds a robot to the table, so that its name works everywhere.

    Args:
        robot: The robot; its name is lower-case. Adding the same object again does nothing.

    Returns:
        The robot, for ``MINE = register_robot(Robot(...))``.

    Raises:
        InvalidDataError: The name is not lower-case, or another robot has it.
    """
    if robot.name != robot.name.lower() or not robot.name:
        raise InvalidDataError("Robot registry", "name", "lower-case", repr(robot.name))
    if _ROBOTS.get(robot.name, robot) is not robot:
        raise InvalidDataError("Robot registry", "name", "unused", f"{robot.name!r} twice")
    _ROBOTS[robot.name] = robot
    return robot
