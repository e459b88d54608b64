"""Gymnasium environments for humanoid robots that make their own reference motions.

Importing the package registers the environments ``OmniEnvs/<Robot><Task>-v0``::

    import gymnasium, omni_envs

    env = gymnasium.make("OmniEnvs/G1BoxCarry-v0")
"""

import os
import sys

# MuJoCo reads this when it is imported: without a display its default, GLFW, cannot render.
if sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & set(os.environ):
    os.environ.setdefault("MUJOCO_GL", "egl")

from omni_envs.errors import OmniEnvsError
from omni_envs.registration import register_all

__version__ = "0.1.0"

__all__ = ["OmniEnvsError", "__version__", "register_all"]

register_all()
