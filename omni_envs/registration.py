"""The table of environment ids: robot × task."""

from __future__ import annotations

from dataclasses import dataclass

import gymnasium

NAMESPACE = "OmniEnvs"


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


_ROBOTS = {"g1": "G1", "h1": "H1", "t1": "T1"}
_TASKS = {"box_carry": "BoxCarry", "climb": "Climb", "crawl": "Crawl", "track": "Track"}

ENVIRONMENTS = tuple(
    EnvId(robot, robot_label, task, task_label)
    for robot, robot_label in _ROBOTS.items()
    for task, task_label in _TASKS.items()
)
"""Every environment that the package registers."""


def register_all() -> None:
    """Registers all environments with Gymnasium; a second call changes nothing."""
    for env in ENVIRONMENTS:
        if env.id not in gymnasium.registry:
            gymnasium.register(
                id=env.id,
                entry_point="omni_envs.envs.env:OmniEnv",
                vector_entry_point="omni_envs.envs.vector_env:OmniVectorEnv",
                kwargs={"robot": env.robot, "task": env.task},
            )
