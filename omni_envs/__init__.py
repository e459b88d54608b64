"""Gymnasium environments for humanoid robots that make their own reference motions.

Importing the package registers the environments ``OmniEnvs/<Robot><Task>-v0``::

    import gymnasium, omni_envs

    env = gymnasium.make("OmniEnvs/G1BoxCarry-v0")
"""

from omni_envs.errors import OmniEnvsError
from omni_envs.registration import register_all

__version__ = "0.1.0"

__all__ = ["OmniEnvsError", "__version__", "register_all"]

register_all()
