"""Tasks: what is tracked by default, and what the body may lean on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from omni_envs.errors import UnknownNameError

_HANDS_AND_FEET = ("left_hand", "right_hand", "left_foot", "right_foot")
_AND_KNEES = (*_HANDS_AND_FEET, "left_knee", "right_knee")


@dataclass(frozen=True)
class Task:
    """A task.

    Attributes:
        name: Its name in options.
        label: Its name in ids.
        demonstration: Built-in demonstration that is tracked where no reference is given; None
            tracks nothing by itself.
        supports: Links that carry weight: a penalty on contacts with the surroundings spares them.
    """

    name: str
    label: str
    demonstration: str | None
    supports: tuple[str, ...] = _HANDS_AND_FEET

    @property
    def changes(self) -> Mapping[str, Any]:
        """What the task changes in every preset."""
        return {"reward": {"may_touch": self.supports}}


TASKS = {
    task.name: task
    for task in (
        Task("box_carry", "BoxCarry", "box_carry"),
        Task("climb", "Climb", "climb", _AND_KNEES),
        Task("crawl", "Crawl", "crawl", _AND_KNEES),
        Task("track", "Track", None),
    )
}
"""Name to task."""


def get_task(name: str) -> Task:
    """Returns a task by name.

    Raises:
        UnknownNameError: There is no such task.
    """
    if name not in TASKS:
        raise UnknownNameError("task", name, TASKS)
    return TASKS[name]
