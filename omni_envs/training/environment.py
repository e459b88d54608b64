"""Making the environment of a run."""

from __future__ import annotations

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


def make_vector_env(env: str, num_envs: int, **options: Any) -> VectorEnv:
    """Makes a vector environment; see ``make_env``."""
    try:
        return gym.make_vec(
            env, num_envs=num_envs, vectorization_mode="vector_entry_point", **options
        )
    except gym.error.Error as error:
        raise InvalidOptionError(f"env {env!r}: {error}") from error
