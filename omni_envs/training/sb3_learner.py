"""Stable-Baselines3 as the trainer of a run."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
from gymnasium.vector import VectorEnv

from omni_envs.errors import MissingDependencyError

try:
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecMonitor
except ImportError as error:
    raise MissingDependencyError("stable-baselines3", "sb3", "Training with SB3") from error

from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import TrainConfig
from omni_envs.training.device import device_rng, restore_rng, torch_device
from omni_envs.training.environment import learning_state, restore_learning_state
from omni_envs.training.learner import History
from omni_envs.training.ppo import TrackingPPO
from omni_envs.training.rollout import tracking_errors
from omni_envs.training.sb3_vec_env import SB3VecEnv


class SB3Learner:
    """``TrackingPPO`` in a vector environment; see ``Learner``.

    Args:
        config: The run.
        env: Vector environment in SAME_STEP autoreset mode.
    """

    def __init__(self, config: TrainConfig, env: VectorEnv) -> None:
        adapter = SB3VecEnv(env)
        self._seed, self._env = config.seed, env
        self._device = torch_device(config.device)
        self._ppo = TrackingPPO(VecMonitor(adapter), config.ppo, config.seed, self._device)
        self._errors = _TrackingErrors(adapter)

    @property
    def steps(self) -> int:
        """Control steps so far."""
        return self._ppo.num_timesteps

    @property
    def weights(self) -> Mapping[str, torch.Tensor]:
        """Weights of the policy as they are now."""
        return self._ppo.policy.state_dict()

    def learn(self) -> dict[str, float]:
        """Collects a rollout and updates the network; see ``Learner``."""
        ppo = self._ppo
        ppo.learn(1, callback=self._errors, log_interval=None, reset_num_timesteps=False)
        episodes = ppo.ep_info_buffer or ()

        def mean(key: str) -> float:
            return float(np.mean([e[key] for e in episodes])) if episodes else float("nan")

        return {
            "episode_length": mean("l"),
            "episode_return": mean("r"),
            **self._errors.means,
            "noise_level": float(getattr(self._env.unwrapped, "noise_level", 1.0)),
            **ppo.figures,
        }

    def state(self, seconds: float, history: History) -> Checkpoint:
        """Returns the state between two updates; see ``Learner``."""
        ppo = self._ppo
        return Checkpoint(
            steps=ppo.num_timesteps,
            seconds=seconds,
            updates=ppo._n_updates,
            learning_rate=ppo.current_learning_rate,
            policy=ppo.policy.state_dict(),
            optimizer=ppo.policy.optimizer.state_dict(),
            rng=torch.get_rng_state(),
            device_rng=device_rng(self._device),
            history=history,
            episodes=[(float(e["r"]), float(e["l"])) for e in ppo.ep_info_buffer or ()],
            environment=learning_state(self._env),
        )

    def restore(self, state: Checkpoint) -> None:
        """Goes on from a state; see ``Learner``."""
        ppo = self._ppo
        ppo.policy.load_state_dict(state.policy)
        ppo.policy.optimizer.load_state_dict(state.optimizer)
        ppo.num_timesteps, ppo._n_updates = state.steps, state.updates
        ppo.current_learning_rate = state.learning_rate
        window = ppo._stats_window_size
        ppo.ep_info_buffer = deque(({"r": r, "l": n} for r, n in state.episodes), maxlen=window)
        ppo.ep_success_buffer = deque(maxlen=window)
        seed = (self._seed + state.steps) % 2**31
        ppo.env.seed(seed)
        ppo.env.reset()
        restore_learning_state(self._env, state.environment)
        ppo._last_obs = None  # SB3 then starts all episodes anew, in what was restored
        restore_rng(self._device, state.rng, state.device_rng, seed)

    def close(self) -> None:
        """Nothing to free: the environment belongs to the caller."""


class _TrackingErrors(BaseCallback):
    """Mean tracking errors over the steps of a rollout."""

    def __init__(self, env: SB3VecEnv) -> None:
        super().__init__()
        self._env = env
        self._infos = tracking_errors(env.env)
        self._values: dict[str, list[float]] = {column: [] for column in self._infos}
        self.means: dict[str, float] = dict.fromkeys(self._infos, float("nan"))

    def _on_step(self) -> bool:
        infos = self._env.batched_infos
        for column, name in self._infos.items():
            if name in infos:
                self._values[column].append(float(np.mean(infos[name])))
        return True

    def _on_rollout_end(self) -> None:
        for column, values in self._values.items():
            self.means[column] = float(np.mean(values)) if values else float("nan")
            values.clear()
