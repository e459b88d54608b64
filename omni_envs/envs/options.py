"""Constructor options of the environments: modes and names that do not exist."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from operator import index
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from omni_envs.errors import InvalidOptionError, UnknownNameError


class UnexpectedOptionError(InvalidOptionError, TypeError):
    """A keyword that the environment does not take.

    It is a ``TypeError`` too, as for any function; some libraries try keywords out and rely on
    that.

    ``gymnasium.make`` raises a ``TypeError`` anew from its message alone, so the message is all
    that the constructor takes; see ``of``.
    """

    @classmethod
    def of(cls, owner: str, name: str, valid: Iterable[str]) -> UnexpectedOptionError:
        """Returns the error of a keyword.

        Args:
            owner: The environment class.
            name: The keyword.
            valid: The keywords that exist.
        """
        valid = sorted(valid)
        close = get_close_matches(name, valid, n=1)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        return cls(
            f"{owner}.__init__() got an unexpected keyword argument '{name}'.{hint} "
            f"Valid: {', '.join(valid)}."
        )


def refuse_unknown(cls: type, unknown: Mapping[str, Any]) -> None:
    """Raises for the first keyword that the constructor of a class did not recognise.

    Raises:
        UnexpectedOptionError: There is one.
    """
    parameters = inspect.signature(cls.__init__).parameters.values()  # type: ignore[misc]
    valid = [p.name for p in parameters if p.name != "self" and p.kind is not p.VAR_KEYWORD]
    for name in unknown:
        raise UnexpectedOptionError.of(cls.__name__, name, valid)


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Returns the autoreset mode of a name; ``SAME_STEP`` and ``DISABLED`` are supported.

    Raises:
        UnknownNameError: Another one.
    """
    supported = {m.name: m for m in (AutoresetMode.SAME_STEP, AutoresetMode.DISABLED)}
    name = mode.name if isinstance(mode, AutoresetMode) else str(mode).upper()
    if name not in supported:
        raise UnknownNameError("autoreset mode", name, supported)
    return supported[name]


def check_whole(name: str, value: Any, least: int) -> None:
    """Refuses what is no whole number from ``least`` on.

    Raises:
        InvalidOptionError: It is not; the message has the name.
    """
    if not isinstance(value, int | np.integer) or isinstance(value, bool):
        raise InvalidOptionError(f"{name} must be a whole number; got {value!r}.")
    if value < least:
        raise InvalidOptionError(f"{name} must be at least {least}; got {value}.")


def merged_seed(seeds: Any, num: int) -> int | None:
    """Returns a seed, or one seed that depends on all of a list, where any is not None.

    Args:
        seeds: A whole number, or one or None for each of the simulations.
        num: Number of simulations.

    Raises:
        InvalidOptionError: It is something else.
    """
    one = isinstance(seeds, int | np.integer)
    try:
        each = [None if s is None else index(s) for s in ([seeds] if one else seeds)]
        good = (one or len(each) == num) and all(s is None or s >= 0 for s in each)
    except TypeError:
        good = False
    if not good:
        raise InvalidOptionError(
            "reset: seed must be a whole number from 0 on, or a list of these and None, one for "
            f"each of the {num} simulations; got {seeds!r}."
        )
    if one or all(s is None for s in each):
        return each[0]
    return int(np.random.SeedSequence([s or 0 for s in each]).generate_state(1)[0])
