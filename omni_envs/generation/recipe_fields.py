"""Checks of the fields of a recipe: every complaint names file, field and what is valid."""

from __future__ import annotations

from pathlib import Path
from reprlib import repr as shown
from typing import Any

from omni_envs.errors import FileFormatError


def check_fields(
    path: Path, place: str, data: Any, valid: tuple[str, ...] | None, needed: tuple[str, ...] = ()
) -> None:
    """Holds a mapping against the names that it may and must have; None allows any name.

    Raises:
        FileFormatError: No mapping, a name that it may not have, or one that it lacks.
    """
    if not isinstance(data, dict):
        raise FileFormatError(path, place, "a mapping", shown(data))
    for name in data:
        if not isinstance(name, str) or (valid is not None and name not in valid):
            known = "a name" if valid is None else f"one of {', '.join(valid)}"
            raise FileFormatError(path, f"{place}.{name}", known, "an unknown field")
    for name in needed:
        if name not in data:
            raise FileFormatError(path, f"{place}.{name}", "to be there", "no such field")


def check_whole(path: Path, place: str, value: Any, least: int) -> None:
    """Refuses what is no whole number from ``least`` on.

    Raises:
        FileFormatError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise FileFormatError(path, place, f"a whole number from {least} on", shown(value))
