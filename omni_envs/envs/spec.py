"""The spec of an environment, which another process makes it from: options as JSON has them."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec

from omni_envs.robots import Robot, get_robot, robot_names


class PlainSpec:
    """Has the ``spec`` that ``gymnasium.make`` sets hold what ``spec.to_json`` can write.

    Paths become texts, modes and registered robots their names, numbers and arrays of numpy those
    of Python. A ``Reference`` or a ``Demonstration`` stays what it is: only its file has a name.
    """

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """What the environment was made from."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None:
            spec.kwargs = plain(spec.kwargs)
        self._spec = spec


def plain(value: Any) -> Any:
    """Returns an option as JSON has it, as far as it has it."""
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Robot) and value.name in robot_names() and get_robot(value.name) is value:
        return value.name
    return value
