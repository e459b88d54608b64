"""Observations and infos of N simulations, in the form of Gymnasium's vector environments."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from gymnasium import spaces

from omni_envs.errors import InvalidDataError

Observation = np.ndarray | dict[str, np.ndarray]
"""(N, size), or ``{"policy": (N, size), "critic": (N, size)}``."""


def observation_space(policy: int, critic: int | None) -> spaces.Space:
    """Returns the space of one observation: a box, or a dictionary of two with a critic."""

    def box(size: int) -> spaces.Box:
        return spaces.Box(-np.inf, np.inf, (size,), np.float32)

    if critic is None:
        return box(policy)
    return spaces.Dict({"policy": box(policy), "critic": box(critic)})


def real_array(owner: str, name: str, values: Any) -> np.ndarray:
    """Returns values as a contiguous float64 array.

    Args:
        owner: Whose they are, for the message.
        name: What they are, for the message.
        values: Anything that numpy makes an array of real numbers from.

    Raises:
        InvalidDataError: It does not.
    """
    try:
        return np.ascontiguousarray(values, float)
    except (TypeError, ValueError) as error:
        got = f"{type(values).__name__} ({error})"
        raise InvalidDataError(owner, name, "real numbers", got) from error


def copied(observations: Observation) -> Observation:
    """Returns a copy."""
    if isinstance(observations, dict):
        return {key: values.copy() for key, values in observations.items()}
    return observations.copy()


def row_of(observations: Observation, index: int = 0) -> Observation:
    """Returns a copy of one simulation's observation."""
    if isinstance(observations, dict):
        return {key: values[index].copy() for key, values in observations.items()}
    return observations[index].copy()


def empty_observations(num: int, policy: int, critic: int | None) -> Observation:
    """Returns room for N observations."""
    if critic is None:
        return np.empty((num, policy), np.float32)
    sizes = {"policy": policy, "critic": critic}
    return {key: np.empty((num, size), np.float32) for key, size in sizes.items()}


class Infos:
    """Makes infos of N simulations: each key with a mask ``_key`` of who has it.

    Args:
        names: The keys.
        num: N.
    """

    def __init__(self, names: Iterable[str], num: int) -> None:
        self.names = tuple(names)
        self._masks = tuple(f"_{name}" for name in self.names)
        everyone = np.ones(num, bool)
        everyone.flags.writeable = False  # it is handed out every time
        self._template: dict[str, Any] = dict.fromkeys((*self.names, *self._masks), everyone)

    def of(self, rows: Iterable[np.ndarray]) -> dict[str, Any]:
        """Returns infos that every simulation has, from (N,) values for each name."""
        infos = self._template.copy()
        infos.update(zip(self.names, rows, strict=True))
        return infos

    def masked(self, infos: dict[str, Any], who: np.ndarray) -> dict[str, Any]:
        """Returns the same infos as those of some simulations, (N,)."""
        return infos | dict.fromkeys(self._masks, who)


def add_finals(
    infos: dict[str, Any], final_info: dict[str, Any], observations: Observation, done: np.ndarray
) -> None:
    """Adds ``final_obs`` and ``final_info`` of finished simulations, as SyncVectorEnv does.

    Args:
        infos: To add to: ``final_obs``, an (N,) object array of observations and None, and
            ``final_info``.
        final_info: Infos of the step, masked by ``done``.
        observations: (N, …) observations, still those of the finished episodes.
        done: (N,) which simulations are finished.
    """
    final_obs = np.full(len(done), None, dtype=object)
    for i in done.nonzero()[0].tolist():
        final_obs[i] = row_of(observations, i)
    infos["final_obs"], infos["_final_obs"] = final_obs, done
    infos["final_info"], infos["_final_info"] = final_info, done
