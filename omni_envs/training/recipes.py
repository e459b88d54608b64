"""Complete settings that are known to train."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from omni_envs.training.config import PPOConfig


@dataclass(frozen=True)
class Recipe:
    """Hyper-parameters and the environment options that go with them.

    Attributes:
        ppo: Hyper-parameters.
        env_options: Options of the environment.
    """

    ppo: PPOConfig
    env_options: Mapping[str, Any] = field(default_factory=dict)


_PRIVILEGED = {"observation": {"privileged": True}}

RECIPES: Mapping[str, Recipe] = {
    # For thousands of simulations and 10⁸ steps and more.
    "published": Recipe(PPOConfig(), _PRIVILEGED),
    # For a few cores and minutes: actions are offsets from the reference, the network is small, and
    # little exploration noise keeps the robot on its feet from the start.
    "small": Recipe(
        PPOConfig(hidden=(256, 128), initial_std=0.3, learning_rate=3e-4, desired_kl=0.0),
        {**_PRIVILEGED, "action": {"mode": "residual"}},
    ),
}
"""Name to recipe: BeyondMimic's, and one that learns within minutes on two cores."""
