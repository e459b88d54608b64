"""Complete settings that are known to train."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from omni_envs.training.config import PRIVILEGED, PPOConfig


@dataclass(frozen=True)
class Recipe:
    """Hyper-parameters and options that go together.

    Attributes:
        ppo: Hyper-parameters.
        num_envs: Simulations.
        env_options: Options of the task.
        training_options: Options in training alone.
    """

    ppo: PPOConfig
    num_envs: int
    env_options: Mapping[str, Any] = field(default_factory=dict)
    training_options: Mapping[str, Any] = field(default_factory=lambda: PRIVILEGED)


_RESIDUAL = {"action": {"mode": "residual"}}
_SMALL = PPOConfig(
    rollout_steps=16,
    learning_rate=3e-4,
    desired_kl=0.0,
    value_clip=0.0,
    hidden=(256, 128),
    initial_std=0.3,
)

RECIPES: Mapping[str, Recipe] = {
    # BeyondMimic's: for thousands of simulations and 10⁸ steps and more.
    "published": Recipe(PPOConfig(), num_envs=4096),
    # For a few cores and hours. Actions are offsets from the reference, little exploration noise
    # keeps the robot on its feet from the start, and small rollouts give many updates per sample.
    "small": Recipe(_SMALL, 128, _RESIDUAL),
    # For a few cores and minutes: as above, and nothing is left to chance in training.
    "quick": Recipe(
        _SMALL,
        128,
        _RESIDUAL,
        {
            "observation": {"privileged": True, "noise": None},
            "reset": {"noise": None},
            "randomization": {
                "torso_centre_of_mass": None,
                "joint_default": 0.0,
                "friction": None,
                "push": None,
                "object": None,
            },
            "physics": "fast",
        },
    ),
}
"""Name to recipe."""
