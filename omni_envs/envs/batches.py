"""Observations and infos of N simulations, in the form of Gymnasium's vector environments."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from gymnasium import spaces

Observation = np.ndarray | dict[str, np.ndarray]
"""(N, size), or ``{"policy": (N, size), "critic": (N, size)}``."""


def observation_space(policy: int, critic: int | None) -> spaces.Space:
    """Returns the space of one observation: a box, or a dictionary of two with a critic."""

    def box(size: int) -> spaces.Box:
        return spaces.Box(-np.inf, np.inf, (size,), np.float32)

    if critic is None:
        return box(policy)
    return spaces.Dict({"policy": box(policy), "critic": box(critic)})


def copied(observations: Observation) -> Observation:
    """Returns a copy."""
    if isinstance(observations, dict):
        return {key: values.copy() for key, values in observations.items()}
    return observations.copy()


def first_row(observations: Observation) -> Observation:
    """Returns a copy of the first simulation's observation."""
    if isinstance(observations, dict):
        return {key: values[0].copy() for key, values in observations.items()}
    return observations[0].copy()


def empty_observations(num: int, policy: int, critic: int | None) -> Observation:
    """Returns room for N observations."""
    if critic is None:
        return np.empty((num, policy), np.float32)
    sizes = {"policy": policy, "critic": critic}
    return {key: np.empty((num, size), np.float32) for key, size in sizes.items()}


def batched_infos(values: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Returns infos that every simulation has: each key with a mask ``_key`` of who has it."""
    infos: dict[str, Any] = dict(values)
    everyone = np.ones(len(next(iter(values.values()))), bool)
    infos.update(dict.fromkeys(map(_mask_name, values), everyone))
    return infos


@cache
def _mask_name(key: str) -> str:
    return f"_{key}"


def add_finals(
    infos: dict[str, Any], observations: Observation, done: np.ndarray
) -> dict[str, Any]:
    """Adds ``final_obs`` and ``final_info`` of finished simulations, as SyncVectorEnv does.

    Args:
        infos: Infos of the step, still those of the finished episodes.
        observations: (N, …) observations, still those of the finished episodes.
        done: (N,) which simulations are finished.

    Returns:
        ``infos`` with ``final_obs``, an (N,) object array of observations and None, and
        ``final_info`` with the infos of the step masked by ``done``.
    """
    final_obs = np.full(len(done), None, dtype=object)
    for i in np.flatnonzero(done):
        final_obs[i] = (
            {key: rows[i].copy() for key, rows in observations.items()}
            if isinstance(observations, dict)
            else observations[i].copy()
        )
    mask = done.copy()
    final_info = {k: mask if k.startswith("_") else v for k, v in infos.items()}
    return infos | {
        "final_obs": final_obs,
        "_final_obs": mask,
        "final_info": final_info,
        "_final_info": mask,
    }
