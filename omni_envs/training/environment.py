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
    try:
        return gym.make_vec(
            config.env,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            num_threads=config.num_threads,
            **options,
        )
    except gym.error.Error as error:
        raise InvalidOptionError(f"env {config.env!r}: {error}") from error
