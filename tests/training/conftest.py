"""A small vector environment: chase a moving point, fast enough to learn in a test."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv

HORIZON, DIMENSIONS = 20, 2


class Chase(VectorEnv):
    """Position += 0.1 · action towards a target; ends beyond 1.0, is truncated after 20 steps."""

    def __init__(
        self,
        num_envs: int = 8,
        privileged: bool = True,
        autoreset_mode: AutoresetMode = AutoresetMode.SAME_STEP,
    ) -> None:
        self.num_envs, self.privileged = num_envs, privileged
        self.autoreset_mode = autoreset_mode
        self.metadata = {"autoreset_mode": autoreset_mode, "render_modes": []}
        box = spaces.Box(-np.inf, np.inf, (DIMENSIONS,), np.float32)
        wide = spaces.Box(-np.inf, np.inf, (2 * DIMENSIONS,), np.float32)
        self.single_observation_space = (
            spaces.Dict({"policy": box, "critic": wide}) if privileged else box
        )
        self.single_action_space = spaces.Box(-2.0, 2.0, (DIMENSIONS,), np.float32)
        self.observation_space = gym.vector.utils.batch_space(
            self.single_observation_space, num_envs
        )
        self.action_space = gym.vector.utils.batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        super().reset(seed=seed)
        mask = (options or {}).get("reset_mask")
        if mask is not None:
            self._place(mask)
            return self._observe(), {"frame": self.time.copy()}
        self.position = np.zeros((self.num_envs, DIMENSIONS))
        self.time = np.zeros(self.num_envs, int)
        self._place(np.ones(self.num_envs, bool))
        return self._observe(), {"frame": self.time.copy()}

    def step(self, actions: np.ndarray):
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            assert self.action_space.contains(np.asarray(actions, np.float32))
        actions = np.clip(actions, -2.0, 2.0)
        self.position += 0.1 * actions
        self.time += 1
        distance = np.linalg.norm(self.position, axis=1)
        reward = np.exp(-10.0 * distance**2)
        terminated = distance > 1.0
        truncated = self.time >= HORIZON
        infos: dict[str, Any] = {"error/body_position": distance.copy()}
        done = terminated | truncated
        if done.any() and self.autoreset_mode is AutoresetMode.SAME_STEP:
            infos["final_obs"], infos["_final_obs"] = self._observe(), done
            infos["final_info"] = {
                "error/body_position": distance.copy(),
                "_error/body_position": done,
            }
            self._place(done)
        infos["frame"] = self.time.copy()
        return self._observe(), reward, terminated, truncated, infos

    def _place(self, mask: np.ndarray) -> None:
        count = int(mask.sum())
        self.position[mask] = self.np_random.uniform(-0.6, 0.6, (count, DIMENSIONS))
        self.time[mask] = 0

    def _observe(self) -> Any:
        seen = (self.position * 5.0 + 3.0).astype(np.float32)
        if not self.privileged:
            return seen
        return {
            "policy": seen,
            "critic": np.concatenate([seen, self.position], axis=1).astype(np.float32),
        }


@pytest.fixture(scope="session")
def chase() -> type[Chase]:
    """The class, so that a test chooses the number of environments."""
    return Chase
