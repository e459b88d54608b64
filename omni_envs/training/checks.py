"""Checks of settings: one error that names the owner, the field and what it must be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from math import inf
from typing import Any

from omni_envs.errors import InvalidOptionError


def positive(owner: str, name: str, value: Any) -> None:
    """Refuses a value that is no finite number above 0."""
    if not _number(value) or not 0 < value < inf:
        raise InvalidOptionError(f"{owner}: {name} must be positive; got {value!r}.")


def within(
    owner: str,
    name: str,
    value: Any,
    words: str,
    low: float,
    high: float = inf,
    whole: bool = False,
) -> None:
    """Refuses a value outside ``low`` to ``high``; ``words`` say so in the message."""
    good = whole_number(value, low) if whole else _number(value) and low <= value <= high
    if not good or value == inf:
        raise InvalidOptionError(f"{owner}: {name} must be {words}; got {value!r}.")


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def whole_number(value: Any, low: float) -> bool:
    """Returns whether a value is a whole number from ``low`` on."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= low


def known(owner: str, data: Mapping[str, Any], cls: type) -> None:
    """Refuses keys that are no fields of a dataclass."""
    valid = {f.name for f in fields(cls)}
    unknown = sorted(set(data) - valid)
    if unknown:
        raise InvalidOptionError(f"{owner}: unknown {unknown}. Valid: {', '.join(sorted(valid))}.")
