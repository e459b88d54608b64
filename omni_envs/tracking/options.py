"""Options as dataclasses or mappings: conversion with errors that name the valid fields."""

from __future__ import annotations

import dataclasses
import math
import types
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from omni_envs.errors import InvalidOptionError, UnknownNameError

T = TypeVar("T")


def override(base: T, changes: Any, owner: str) -> T:
    """Returns a frozen dataclass with some fields changed.

    Args:
        base: The dataclass to start from.
        changes: None (no change), an instance of the same class (taken as it is) or a mapping of
            field to value, where nested dataclasses may be mappings too.
        owner: What the options belong to, for messages, e.g. ``"reward"``.

    Raises:
        UnknownNameError: A field does not exist.
        InvalidOptionError: A value has the wrong type or size.
    """
    if changes is None:
        return base
    cls = type(base)
    if isinstance(changes, cls):
        return changes
    if not isinstance(changes, Mapping):
        raise InvalidOptionError(
            f"{owner}: expected a mapping or a {cls.__name__}; got {type(changes).__name__}."
        )
    hints = get_type_hints(cls)
    values = {}
    for name, value in changes.items():
        if name not in hints:
            raise UnknownNameError(f"{owner} option", name, hints)
        values[name] = _convert(hints[name], value, f"{owner}.{name}", getattr(base, name))
    return dataclasses.replace(base, **values)  # type: ignore[type-var]


def _convert(hint: Any, value: Any, owner: str, current: Any) -> Any:
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        options = get_args(hint)
        if value is None and type(None) in options:
            return None
        (kind,) = (o for o in options if o is not type(None))
        return _convert(kind, value, owner, current)
    if dataclasses.is_dataclass(hint):
        if value is None:
            raise InvalidOptionError(f"{owner}: cannot be switched off.")
        start = current if current is not None else hint()  # type: ignore[operator]
        return override(start, value, owner)
    if origin is Literal:
        if value not in get_args(hint):
            raise UnknownNameError(f"{owner} value", value, map(str, get_args(hint)))
        return value
    if origin is tuple:
        return _tuple(get_args(hint), value, owner)
    if hint is bool and isinstance(value, bool):
        return value
    if hint is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if hint is float and _is_number(value):
        return float(value)
    if hint is str and isinstance(value, str):
        return value
    raise InvalidOptionError(f"{owner}: expected {_name(hint)}; got {value!r}.")


def _tuple(kinds: tuple[Any, ...], value: Any, owner: str) -> tuple[Any, ...]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InvalidOptionError(f"{owner}: expected a list; got {value!r}.")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(value) != len(kinds):
        raise InvalidOptionError(f"{owner}: expected {len(kinds)} values; got {value!r}.")
    return tuple(
        _convert(kind, v, f"{owner}[{i}]", None)
        for i, (kind, v) in enumerate(zip(kinds, value, strict=True))
    )


def _is_number(value: Any) -> bool:
    is_real = isinstance(value, int | float) or hasattr(value, "__float__")
    return is_real and not isinstance(value, bool) and not math.isnan(float(value))


def _name(hint: Any) -> str:
    return {float: "a number", int: "a whole number", bool: "True or False", str: "a text"}.get(
        hint, str(hint)
    )
