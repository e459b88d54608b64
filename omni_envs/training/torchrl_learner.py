"""TorchRL as the trainer of a run."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv

from omni_envs.errors import MissingDependencyError

try:
    import torch
    from tensordict import TensorDictBase
    from torchrl.collectors import Collector
except ImportError as error:
    raise MissingDependencyError("torchrl", "torchrl", "Training with TorchRL") from error

from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import TrainConfig
from omni_envs.training.device import device_rng, restore_rng, torch_device
from omni_envs.training.environment import learning_state, restore_learning_state
from omni_envs.training.learner import History
from omni_envs.training.rollout import tracking_errors
from omni_envs.training.torch_threads import torch_threads
from omni_envs.training.torchrl_env import EPISODE_LENGTH, EPISODE_RETURN, make_torchrl_env
from omni_envs.training.torchrl_network import TrackingNetwork, actor_and_critic, observation_keys
from omni_envs.training.torchrl_ppo import TensorDictPPO


class TorchRLLearner:
    """``TensorDictPPO`` on what a ``Collector`` yields; see ``Learner``.

    Args:
        config: The run.
        env: Vector environment in DISABLED autoreset mode.
    """

    def __init__(self, config: TrainConfig, env: VectorEnv) -> None:
        torch.manual_seed(config.seed)
        self._config, self._vector = config, env
        self._device = torch_device(config.device)
        self._errors = tracking_errors(env)
        self._env = make_torchrl_env(env, infos=tuple(self._errors.values()))
        keys = list(self._env.observation_spec.keys())
        seen, privileged = observation_keys(keys)
        space: Any = env.single_action_space
        network = TrackingNetwork(
            self._env.observation_spec[seen].shape[-1],
            self._env.observation_spec[privileged].shape[-1],
            torch.as_tensor(space.low),
            torch.as_tensor(space.high),
            config.ppo.hidden,
            config.ppo.initial_std,
        ).to(self._device)
        self.ppo = TensorDictPPO(network, *actor_and_critic(network, keys), config.ppo)
        self._env.set_seed(config.seed)
        self._steps = 0
        self._episodes: deque[tuple[float, float]] = deque(maxlen=max(100, env.num_envs))
        self._collector: Collector | None = None
        self._rollouts: Iterator[TensorDictBase] = iter(())

    @property
    def steps(self) -> int:
        """Control steps so far."""
        return self._steps

    @property
    def weights(self) -> Mapping[str, torch.Tensor]:
        """Weights of the policy as they are now."""
        return self.ppo.network.state_dict()

    def learn(self) -> dict[str, float]:
        """Collects a rollout and updates the network; see ``Learner``."""
        if self._collector is None:
            self._collector = Collector(
                self._env,
                self.ppo.actor,
                frames_per_batch=self._config.ppo.rollout_steps * self._env.batch_size.numel(),
                env_device="cpu",
                policy_device=self._device,
                storing_device=self._device,
                auto_register_policy_transforms=False,
            )
            self._rollouts = iter(self._collector)
        with torch_threads(1):  # the cores belong to the physics
            rollout = next(self._rollouts)
        self._steps += rollout.numel()
        done = rollout["next", "done"]
        ends = (rollout["next", key][done].tolist() for key in (EPISODE_RETURN, EPISODE_LENGTH))
        self._episodes.extend(zip(*ends, strict=True))
        mean = np.mean(self._episodes, axis=0) if self._episodes else (np.nan, np.nan)
        errors = {c: rollout["next", name].mean().item() for c, name in self._errors.items()}
        with torch_threads(max(1, (os.cpu_count() or 1) // 2)):
            figures = self.ppo.learn(rollout)
        return {
            "episode_length": float(mean[1]),
            "episode_return": float(mean[0]),
            **errors,
            "noise_level": float(getattr(self._vector.unwrapped, "noise_level", 1.0)),
            **figures,
        }

    def state(self, seconds: float, history: History) -> Checkpoint:
        """Returns the state between two updates; see ``Learner``."""
        return Checkpoint(
            steps=self._steps,
            seconds=seconds,
            updates=self.ppo.updates,
            learning_rate=self.ppo.learning_rate,
            policy=self.ppo.network.state_dict(),
            optimizer=self.ppo.optimizer.state_dict(),
            rng=torch.get_rng_state(),
            device_rng=device_rng(self._device),
            history=history,
            episodes=list(self._episodes),
            environment=learning_state(self._vector),
        )

    def restore(self, state: Checkpoint) -> None:
        """Goes on from a state; see ``Learner``."""
        self.ppo.network.load_state_dict(state.policy)
        self.ppo.optimizer.load_state_dict(state.optimizer)
        self.ppo.learning_rate, self.ppo.updates = state.learning_rate, state.updates
        self._steps = state.steps
        self._episodes.extend(state.episodes)
        seed = (self._config.seed + state.steps) % 2**31
        self._env.set_seed(seed)  # resets with it; what starts the episodes is a further reset
        restore_learning_state(self._vector, state.environment)
        restore_rng(self._device, state.rng, state.device_rng, seed)

    def close(self) -> None:
        """Frees the collector; the environment belongs to the caller."""
        if self._collector is not None:
            self._collector.shutdown(close_env=False)
