"""The task compiled: for each simulation everything in one pass, without temporary arrays.

What is computed here is defined by the plain functions on arrays (``alignment``, ``rewards``,
``terminations``, ``observations``, ``randomization``); a test holds these loops to them. Numba
compiles on first use and keeps the result on disk, see ``omni_envs.compilation``.

Arrays named ``out`` are written to. ``rows`` are rows of ``MotionLibrary.table``, ``at`` are its
columns.
"""

from omni_envs.tracking.kernels.judgement import judge
from omni_envs.tracking.kernels.kinematics import place_bodies
from omni_envs.tracking.kernels.observation import observe, uniform
from omni_envs.tracking.kernels.plan import Clocks, Numbers, Plan, Tree, make_plan, unpack
from omni_envs.tracking.kernels.simulation import (
    choose_models,
    copy_states,
    exchange_models,
    exploded,
    joint_targets,
)
from omni_envs.tracking.kernels.sines import sines
from omni_envs.tracking.kernels.starts import (
    NEVER,
    draw_frames,
    next_push,
    start_clocks,
    start_states,
)
from omni_envs.tracking.kernels.step import advance, begin, look, settle

__all__ = [
    "NEVER",
    "Clocks",
    "Numbers",
    "Plan",
    "Tree",
    "advance",
    "begin",
    "choose_models",
    "copy_states",
    "draw_frames",
    "exchange_models",
    "exploded",
    "joint_targets",
    "judge",
    "look",
    "make_plan",
    "next_push",
    "observe",
    "place_bodies",
    "settle",
    "sines",
    "start_clocks",
    "start_states",
    "uniform",
    "unpack",
]
