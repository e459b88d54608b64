"""The table of robots, open to robots from outside the package."""

from __future__ import annotations

import re
from collections.abc import Iterable

from omni_envs.errors import InvalidDataError, OmniEnvsError, UnknownNameError
from omni_envs.registration import GROUP, announced_robots, register_environments
from omni_envs.robots.g1 import G1
from omni_envs.robots.h1 import H1
from omni_envs.robots.robot import Robot
from omni_envs.robots.t1 import T1

_ROBOTS: dict[str, Robot] = {robot.name: robot for robot in (G1, H1, T1)}


def robot_names() -> tuple[str, ...]:
    """Returns the names of all robots: built-in, registered, announced by other packages."""
    return tuple(dict.fromkeys((*_ROBOTS, *announced_robots())))


def get_robot(name: str | Robot) -> Robot:
    """Looks a robot up, and imports the package that announces it where need be.

    Args:
        name: A registered name, in any case; a ``Robot`` is returned as it is.

    Raises:
        UnknownNameError: No robot of that name is registered.
        OmniEnvsError: A package announces the robot but does not bring it.
    """
    if isinstance(name, Robot):
        return name
    own = str(name).lower()
    if own not in _ROBOTS:
        _load(own)
    if own not in _ROBOTS:
        raise UnknownNameError("robot", name, robot_names())
    return _ROBOTS[own]


def _load(name: str) -> None:
    """Imports a robot that another package announces; no such robot is no error."""
    point = announced_robots().get(name)
    if point is None:
        return
    place = f"Robot {name!r}, announced as {point.value} ({GROUP})"
    try:
        robot = point.load()
    except Exception as error:  # whatever that package does
        raise OmniEnvsError(f"{place}: {type(error).__name__}: {error}") from error
    if not isinstance(robot, Robot) or robot.name != name:
        found = f"the robot {robot.name!r}" if isinstance(robot, Robot) else type(robot).__name__
        raise OmniEnvsError(f"{place}: expected a Robot of that name; found {found}.")
    register_robot(robot)


def register_robot(robot: Robot) -> Robot:
    """Adds a robot to the table, so that its name works everywhere, and registers environments.

    Args:
        robot: The robot. Its name is of lower-case letters, digits and _; the environments of
            ``my_robot`` are called ``OmniEnvs/MyRobot<Task>-v0``. Adding the same object again
            does nothing.

    Returns:
        The robot, for ``MINE = register_robot(Robot(...))``.

    Raises:
        InvalidDataError: The name is no such name, or another robot has it.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", robot.name):
        expected = "lower-case letters, digits and _"
        raise InvalidDataError("Robot registry", "name", expected, repr(robot.name))
    if _ROBOTS.get(robot.name, robot) is not robot:
        raise InvalidDataError("Robot registry", "name", "unused", f"{robot.name!r} twice")
    _ROBOTS[robot.name] = robot
    register_environments(robot.name)
    return robot


def adopt_robots(robots: Iterable[Robot]) -> None:
    """Registers robots that this process lacks: those that another one, its parent, sends along."""
    for robot in robots:
        if robot.name not in _ROBOTS:
            register_robot(robot)
