"""Gymnasium environments for humanoid robots that make their own reference motions."""

from omni_envs.errors import OmniEnvsError

__version__ = "0.1.0"

__all__ = ["OmniEnvsError", "__version__"]
