"""What ``reference=`` of an environment may be, resolved to references."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Union

from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.references import Reference
from omni_envs.robots import Robot
from omni_envs.scenes import Scene

ReferenceLike = Union[str, Path, Reference, Demonstration]  # noqa: UP007
"""A reference file, a reference, or a demonstration to make one from (and cache)."""


def resolve_references(
    source: ReferenceLike | Sequence[ReferenceLike] | None, robot: Robot, task: str
) -> tuple[Reference, ...]:
    """Turns the option ``reference`` into references.

    Args:
        source: One or several; None takes the built-in demonstration of the task.
        robot: The robot.
        task: Name of the task.

    Raises:
        InvalidOptionError: Something else was given.
        FileFormatError: A file is missing or damaged.
    """
    if source is None:
        from omni_envs.demonstrations import builtin_demonstration

        source = builtin_demonstration(task)
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
        return Reference.load(item)
    if isinstance(item, Demonstration):
        from omni_envs.references import cached_reference

        return cached_reference(item, robot)
    raise InvalidOptionError(
        "reference: expected a path, a Reference, a Demonstration or a list of these; "
        f"got {type(item).__name__}."
    )


def common_scene(references: Sequence[Reference]) -> Scene:
    """Returns the scene that all references share.

    Raises:
        InvalidDataError: They stand in different scenes.
    """
    scene = references[0].scene
    for other in references[1:]:
        if other.scene.to_dict() != scene.to_dict():
            raise InvalidDataError(
                "Environment", "reference", "references that share one scene", "different scenes"
            )
    return scene
