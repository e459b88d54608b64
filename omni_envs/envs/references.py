"""What ``reference=`` of an environment may be, resolved to references."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Union

import numpy as np

from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.envs.tasks import Task
from omni_envs.errors import InvalidOptionError
from omni_envs.progress import progress_bar
from omni_envs.references import Reference, open_reference
from omni_envs.robots import Robot
from omni_envs.scenes import Scene

ReferenceLike = Union[str, Path, Reference, Demonstration]  # noqa: UP007
"""A file of a reference or of another project's motion, a reference, or a demonstration to make one
from (and cache)."""


def resolve_references(
    source: ReferenceLike | Sequence[ReferenceLike] | None, robot: Robot, task: Task
) -> tuple[Reference, ...]:
    """Turns the option ``reference`` into references.

    Args:
        source: One or several; None takes the built-in demonstration of the task.
        robot: The robot.
        task: The task.

    Raises:
        InvalidOptionError: Something else was given, or nothing to a task that needs a reference.
        FileFormatError: A file is missing or damaged.
        InvalidDataError: A file of another project has an object, and so needs its scene first.
    """
    if source is None:
        from omni_envs.demonstrations import builtin_demonstration

        if task.demonstration is None:
            raise InvalidOptionError(
                f"reference: the task {task.name!r} tracks what it is given; name a reference "
                "file, a Reference or a Demonstration."
            )
        source = builtin_demonstration(task.demonstration)
    if isinstance(source, str | Path | Reference | Demonstration):
        source = [source]
    if not isinstance(source, Sequence):
        raise InvalidOptionError(
            "reference: expected a path, a Reference, a Demonstration or a list of these; "
            f"got {type(source).__name__}."
        )
    return tuple(_resolve(item, robot) for item in source)


def _resolve(item: ReferenceLike, robot: Robot) -> Reference:
    if isinstance(item, Reference):
        return item
    if isinstance(item, str | Path):
        return open_reference(item, robot)
    if isinstance(item, Demonstration):
        from omni_envs.references import cached_reference

        title = f"{item.name} → {robot.title}"
        with progress_bar(title, disable=not sys.stderr.isatty()) as progress:
            return cached_reference(item, robot, progress=progress)
    raise InvalidOptionError(
        "reference: expected a path, a Reference, a Demonstration or a list of these; "
        f"got {type(item).__name__}."
    )


def distinct_scenes(references: Sequence[Reference]) -> tuple[tuple[Scene, ...], np.ndarray]:
    """Returns the different scenes of references, and (M,) which one each reference has."""
    keys = [json.dumps(r.scene.to_dict(), sort_keys=True) for r in references]
    distinct = list(dict.fromkeys(keys))
    index = np.array([distinct.index(key) for key in keys])
    return tuple(references[keys.index(key)].scene for key in distinct), index
