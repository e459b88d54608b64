"""Demonstrations that ship as code: made on the spot, the same on every machine."""

from __future__ import annotations

from collections.abc import Callable

from omni_envs.demonstrations.builtin.box_carry import box_carry
from omni_envs.demonstrations.builtin.climb import climb
from omni_envs.demonstrations.builtin.crawl import crawl
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.errors import UnknownNameError

_MAKERS: dict[str, Callable[[], Demonstration]] = {
    "box_carry": box_carry,
    "climb": climb,
    "crawl": crawl,
}


def builtin_names() -> tuple[str, ...]:
    """Names of the built-in demonstrations, sorted."""
    return tuple(sorted(_MAKERS))


def builtin_demonstration(name: str) -> Demonstration:
    """Returns a built-in demonstration; it is made once per process.

    Raises:
        UnknownNameError: There is no such demonstration.
    """
    if name not in _MAKERS:
        raise UnknownNameError("built-in demonstration", name, builtin_names())
    return _MAKERS[name]()
