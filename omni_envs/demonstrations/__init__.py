"""Human motion in: demonstrations of every format, and their scaling to a robot."""

from omni_envs.demonstrations.accad import load_accad
from omni_envs.demonstrations.builtin import builtin_demonstration, builtin_names
from omni_envs.demonstrations.contact import object_contacts, terrain_contacts
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.intermimic import load_intermimic
from omni_envs.demonstrations.load import load_demonstration
from omni_envs.demonstrations.mocap import load_mocap
from omni_envs.demonstrations.skeleton import ACCAD, MOCAP, SMPLH, Skeleton
from omni_envs.demonstrations.source_motion import SourceMotion, scale_demonstration
from omni_envs.demonstrations.stance import (
    STANCE_MODES,
    StanceMode,
    stance_intervals,
    stance_schedule,
)
from omni_envs.demonstrations.surface import closest_points

__all__ = [
    "ACCAD",
    "MOCAP",
    "SMPLH",
    "STANCE_MODES",
    "Demonstration",
    "Skeleton",
    "SourceMotion",
    "StanceMode",
    "builtin_demonstration",
    "builtin_names",
    "closest_points",
    "load_accad",
    "load_demonstration",
    "load_intermimic",
    "load_mocap",
    "object_contacts",
    "scale_demonstration",
    "stance_intervals",
    "stance_schedule",
    "terrain_contacts",
]
