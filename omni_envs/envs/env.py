"""The single environment: the vector environment with one simulation."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from omni_envs.envs.options import UnexpectedOptionError
from omni_envs.envs.vector_env import Observation, OmniVectorEnv
from omni_envs.errors import InvalidDataError

_OWN = ("num_envs", "num_threads", "autoreset_mode")


class OmniEnv(gymnasium.Env[Observation, np.ndarray]):
    """A humanoid that tracks a reference motion.

    The code is that of ``OmniVectorEnv`` with one simulation; so are the options.

    Args:
        **options: Options of ``OmniVectorEnv`` but ``num_envs``, ``num_threads`` and ``autoreset_mode``.

    Raises:
        OmniEnvsError: An option or reference is not valid; the message names it.
    """

    def __init__(self, **options: Any) -> None:
        valid = [
            p for p in inspect.signature(OmniVectorEnv).parameters if p not in (*_OWN, "unknown")
        ]
        for name in options:
            if name not in valid:
                raise UnexpectedOptionError(type(self).__name__, name, valid)
        self.vector = OmniVectorEnv(
            1, num_threads=1, autoreset_mode=AutoresetMode.DISABLED, **options
        )
        self.metadata = {k: v for k, v in self.vector.metadata.items() if k != "autoreset_mode"}
        self.render_mode = self.vector.render_mode
        self.observation_space = self.vector.single_observation_space
        self.action_space = self.vector.single_action_space

    def __getattr__(self, name: str) -> Any:
        """Attributes of the vector environment: ``robot``, ``config``, ``policy_layout``, …"""
        if name.startswith("_") or name == "vector":
            raise AttributeError(name)
        return getattr(self.vector, name)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Starts an episode; see ``OmniVectorEnv.reset`` for the options ``motion`` and ``frame``."""
        super().reset(seed=seed)
        observations, infos = self.vector.reset(seed=seed, options=options)
        self._np_random = self.vector.np_random
        return _first(observations), _single(infos)

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advances by a control step.

        Raises:
            InvalidDataError: The action has another shape, or a NaN or infinite entry.
        """
        action = np.asarray(action, float)
        owner = type(self).__name__
        if action.shape != self.action_space.shape:
            expected = f"an array {self.action_space.shape}"
            raise InvalidDataError(owner, "action", expected, f"{action.shape}")
        if not np.isfinite(action).all():
            bad = int(np.flatnonzero(~np.isfinite(action))[0])
            raise InvalidDataError(owner, f"action[{bad}]", "finite", f"{action[bad]}")
        observations, rewards, terminated, truncated, infos = self.vector.step(action[None])
        return (
            _first(observations),
            float(rewards[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            _single(infos),
        )

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Returns a (height, width, 3) uint8 picture, the reference as a ghost."""
        return None if self.render_mode is None else self.vector.render_one()

    def close(self) -> None:
        """Frees the graphics context."""
        self.vector.close()


def _first(observations: Observation) -> Observation:
    if isinstance(observations, dict):
        return {key: values[0] for key, values in observations.items()}
    return observations[0]


def _single(infos: Mapping[str, Any]) -> dict[str, Any]:
    return {key: values[0].item() for key, values in infos.items() if not key.startswith("_")}
