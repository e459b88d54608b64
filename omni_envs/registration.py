"""The table of environment ids: robot × task, and the robots that other packages bring."""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points

import gymnasium

NAMESPACE = "OmniEnvs"

GROUP = "omni_envs.robots"
"""Entry points under which a package announces robots: ``name = "module:ROBOT"``."""

VARIABLE = "OMNI_ENVS_ROBOTS"
"""Environment variable that announces robots without a package: ``name=module:ROBOT,…``."""


@dataclass(frozen=True)
class EnvId:
    """A registered environment.

    Attributes:
        robot: Name of the robot.
        robot_label: The robot's name in the id.
        task: Name of the task, see ``omni_envs.envs.tasks``.
        task_label: The task's name in the id.
        version: Version of the environment.
    """

    robot: str
    robot_label: str
    task: str
    task_label: str
    version: int = 0

    @property
    def id(self) -> str:
        """The Gymnasium id."""
        return f"{NAMESPACE}/{self.robot_label}{self.task_label}-v{self.version}"


_ROBOTS = ("g1", "h1", "t1")
_TASKS = {"box_carry": "BoxCarry", "climb": "Climb", "crawl": "Crawl", "track": "Track"}


def environment_ids(robot: str) -> tuple[EnvId, ...]:
    """The environments of a robot, one per task: those of ``my_robot`` start with ``MyRobot``."""
    label = "".join(word.capitalize() for word in robot.split("_"))
    return tuple(EnvId(robot, label, task, name) for task, name in _TASKS.items())


ENVIRONMENTS = tuple(env for robot in _ROBOTS for env in environment_ids(robot))
"""Every environment that the package itself registers."""


def register_environments(robot: str) -> None:
    """Registers the environments of a robot with Gymnasium; a second call changes nothing."""
    for env in environment_ids(robot):
        if env.id not in gymnasium.registry:
            gymnasium.register(
                id=env.id,
                entry_point="omni_envs.envs.env:OmniEnv",
                vector_entry_point="omni_envs.envs.vector_env:OmniVectorEnv",
                kwargs={"robot": env.robot, "task": env.task},
            )


def register_all() -> None:
    """Registers all environments, those of robots from outside too, without importing these."""
    for robot in (*_ROBOTS, *announced_robots()):
        register_environments(robot)


def announced_robots() -> dict[str, EntryPoint]:
    """Where the robots of other packages are: name to entry point, not loaded yet."""
    found = {point.name: point for point in entry_points(group=GROUP)}
    for words in filter(None, (w.strip() for w in os.environ.get(VARIABLE, "").split(","))):
        name, _, place = words.partition("=")
        if name.strip() and re.fullmatch(r"[\w.]+:[\w.]+", place.strip()):
            found[name.strip()] = EntryPoint(name.strip(), place.strip(), GROUP)
        else:
            warnings.warn(
                f"{VARIABLE}: expected name=module:ROBOT, several with commas between them; found "
                f"{words!r}, which is left out.",
                stacklevel=2,
            )
    return {name: found[name] for name in found if name not in _ROBOTS}
