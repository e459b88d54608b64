"""Gymnasium environments."""

from omni_envs.envs.env import OmniEnv
from omni_envs.envs.vector_env import OmniVectorEnv

__all__ = ["OmniEnv", "OmniVectorEnv"]
