"""The values that options may have: what lies outside is named before anything is built."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from fnmatch import fnmatchcase
from math import inf, isfinite
from typing import Any

from omni_envs.errors import InvalidOptionError

Rule = tuple[str, Callable[[Any], bool]]
"""What is expected, in words, and whether a value is that."""


def _each(test: Callable[[float], bool]) -> Callable[[Any], bool]:
    return lambda value: all(map(test, value)) if isinstance(value, tuple) else test(value)


def _interval(least: Callable[[float], bool]) -> Callable[[Any], bool]:
    return lambda pair: least(pair[0]) and pair[0] <= pair[1] < inf


_POSITIVE = ("a number above 0", _each(lambda v: 0 < v < inf))
_THRESHOLD = ("a number above 0", _each(lambda v: v > 0))
_WIDTH = ("0 or more", _each(lambda v: 0 <= v < inf))
_SHARE = ("from 0 to 1", _each(lambda v: 0 <= v <= 1))
_INTERVAL = ("two numbers above 0, the smaller first", _interval(lambda v: v > 0))
_FINITE = ("a finite number", _each(lambda v: isinstance(v, str | bool) or isfinite(v)))

RULES: tuple[tuple[str, Rule], ...] = (
    ("reward.*.sigma", _POSITIVE),
    ("reward.soft_limit", ("above 0 and at most 1", lambda v: 0 < v <= 1)),
    ("reward.contact_force", _WIDTH),
    ("termination.object_after", _SHARE),
    ("termination.max_seconds", _POSITIVE),
    ("termination.*", _THRESHOLD),
    ("observation.noise.*", _WIDTH),
    ("randomization.friction", ("two numbers from 0 on, the smaller first", _interval(_WIDTH[1]))),
    ("randomization.push.interval", _INTERVAL),
    ("randomization.object.mass", _INTERVAL),
    ("randomization.object.inertia", _INTERVAL),
    ("randomization.object.shape", ("from 0 to below 1", lambda v: 0 <= v < 1)),
    ("randomization.*", _WIDTH),
    ("reset.start_share", _SHARE),
    ("reset.growth.share", _SHARE),
    ("reset.growth.step", _SHARE),
    ("reset.adaptive.uniform", _POSITIVE),
    ("reset.adaptive.kernel", ("1 or more", lambda v: v >= 1)),
    ("reset.adaptive.*", _SHARE),
    ("reset.noise.*", _WIDTH),
    ("action.limit", _POSITIVE),
    ("action.scale", _POSITIVE),
    ("*", _FINITE),
)
"""Path of an option to its rule; the first that fits counts."""


def check_limits(config: Any) -> None:
    """Refuses a task with an option outside its limits.

    Args:
        config: A ``TrackingConfig``.

    Raises:
        InvalidOptionError: There is one; the message names it and what it may be.
    """
    for path, value in _leaves(config, ""):
        expected, allowed = next(rule for pattern, rule in RULES if fnmatchcase(path, pattern))
        try:
            good = value is None or allowed(value)
        except (TypeError, ValueError, IndexError):
            good = False
        if not good:
            raise InvalidOptionError(f"environment.{path}: expected {expected}; got {value!r}.")


def _leaves(config: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for field in fields(config):
        path, value = prefix + field.name, getattr(config, field.name)
        if is_dataclass(value):
            yield from _leaves(value, f"{path}.")
        elif not isinstance(value, str | bool) and not _names(value):
            yield path, value


def _names(value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(v, str) for v in value)
