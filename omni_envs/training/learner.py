"""What a trainer is to a training run: rollout and update in one call, and a state to save."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

from gymnasium.vector import AutoresetMode, VectorEnv

from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import TrainConfig

if TYPE_CHECKING:
    from torch import Tensor

History = list[dict[str, float]]


class Learner(Protocol):
    """A policy that is being trained in an environment."""

    @property
    def steps(self) -> int:
        """Control steps so far, all environments together."""
        ...

    @property
    def weights(self) -> Mapping[str, Tensor]:
        """Weights of the policy as they are now (``Checkpoint.policy``), not a copy."""
        ...

    def learn(self) -> dict[str, float]:
        """Collects a rollout and updates the network.

        Returns:
            Figures to log: ``episode_length`` (control steps) and ``episode_return``, means over
            the episodes that finished last, the columns of ``tracking_errors``, ``noise_level``,
            and those of the update.

        Raises:
            OmniEnvsError: Training diverged.
        """
        ...

    def state(self, seconds: float, history: History) -> Checkpoint:
        """Returns the state between two updates, with the run's time and history so far."""
        ...

    def restore(self, state: Checkpoint) -> None:
        """Goes on from a state; episodes that were under way at that time are not part of it."""
        ...

    def close(self) -> None:
        """Frees what the learner made; the environment stays open."""
        ...


def autoreset_mode(config: TrainConfig) -> AutoresetMode:
    """Returns the mode that the trainer of a run needs its vector environment to be in."""
    return AutoresetMode.DISABLED if config.trainer == "torchrl" else AutoresetMode.SAME_STEP


def make_learner(config: TrainConfig, env: VectorEnv) -> Learner:
    """Makes the trainer of a run.

    Args:
        config: The run.
        env: Vector environment in the mode of ``autoreset_mode``.

    Raises:
        MissingDependencyError: The trainer is not installed.
    """
    if config.trainer == "torchrl":
        from omni_envs.training.torchrl_learner import TorchRLLearner

        return TorchRLLearner(config, env)
    from omni_envs.training.sb3_learner import SB3Learner

    return SB3Learner(config, env)
