"""Making the environment of a run."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
from gymnasium.vector import VectorEnv

import omni_envs  # noqa: F401  (registers the environments)
from omni_envs.errors import InvalidOptionError
from omni_envs.training.config import TrainConfig


def make_env(config: TrainConfig, num_envs: int, options: Mapping[str, Any]) -> VectorEnv:
    """Makes the vector environment of a run.

    Args:
        config: The run.
        num_envs: Simulations.
        options: Options of the environment.

    Raises:
        InvalidOptionError: There is no such environment, or it has no vector form of its own.
        OmniEnvsError: An option is not valid.
    """
    return make_vector_env(config.env, num_envs, num_threads=config.num_threads, **options)


def learning_state(env: VectorEnv) -> dict[str, Any] | None:
    """Returns what episodes have taught an environment, or None where it does not learn."""
    state = getattr(env.unwrapped, "learning_state", None)
    return None if state is None else state()


def restore_learning_state(env: VectorEnv, state: Mapping[str, Any] | None) -> None:
    """Has an environment go on from its ``learning_state``.

    A checkpoint of an earlier version has none: then the environment learns anew, with a warning.

    Raises:
        InvalidDataError: The state is of another environment.
    """
    if state is not None:
        env.unwrapped.restore_learning_state(state)  # type: ignore[attr-defined]
    elif learning_state(env) is not None:
        warnings.warn(
            "The checkpoint is of an earlier version, without the environment's state: growing "
            "start noise, adaptive sampling and the object test begin anew.",
            stacklevel=2,
        )


def make_vector_env(env: str, num_envs: int, **options: Any) -> VectorEnv:
    """Makes a vector environment; see ``make_env``."""
    try:
        return gym.make_vec(
            env, num_envs=num_envs, vectorization_mode="vector_entry_point", **options
        )
    except gym.error.Error as error:
        raise InvalidOptionError(f"env {env!r}: {error}") from error
