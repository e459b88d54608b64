"""Human motion in: demonstrations of every format, and their scaling to a robot."""

from omni_envs.demonstrations.builtin import builtin_demonstration, builtin_names
from omni_envs.demonstrations.bvh_source import load_bvh
from omni_envs.demonstrations.contact import object_contacts, terrain_contacts
from omni_envs.demonstrations.deepmimic import load_deepmimic
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.inspection import Inspection, inspect_recording
from omni_envs.demonstrations.intermimic import load_intermimic
from omni_envs.demonstrations.joint_arrays import load_joint_array
from omni_envs.demonstrations.load import load_demonstration
from omni_envs.demonstrations.mocap import load_mocap
from omni_envs.demonstrations.namings import skeleton_names
from omni_envs.demonstrations.omomo import load_omomo
from omni_envs.demonstrations.skeleton import MOCAP, SMPLH, Skeleton
from omni_envs.demonstrations.skeleton_map import SkeletonMap, read_skeleton_map
from omni_envs.demonstrations.smpl import load_smpl
from omni_envs.demonstrations.source_motion import SourceMotion, scale_demonstration
from omni_envs.demonstrations.source_options import SourceOptions, Unit, UpAxis
from omni_envs.demonstrations.stance import (
    STANCE_MODES,
    StanceMode,
    stance_intervals,
    stance_schedule,
)
from omni_envs.demonstrations.surface import closest_points
from omni_envs.demonstrations.variation import Variation, sample_variations, variation_grid
from omni_envs.demonstrations.varied import vary

__all__ = [
    "MOCAP",
    "SMPLH",
    "STANCE_MODES",
    "Demonstration",
    "Inspection",
    "Skeleton",
    "SkeletonMap",
    "SourceMotion",
    "SourceOptions",
    "StanceMode",
    "Unit",
    "UpAxis",
    "Variation",
    "builtin_demonstration",
    "builtin_names",
    "closest_points",
    "inspect_recording",
    "load_bvh",
    "load_deepmimic",
    "load_demonstration",
    "load_intermimic",
    "load_joint_array",
    "load_mocap",
    "load_omomo",
    "load_smpl",
    "object_contacts",
    "read_skeleton_map",
    "sample_variations",
    "scale_demonstration",
    "skeleton_names",
    "stance_intervals",
    "stance_schedule",
    "terrain_contacts",
    "variation_grid",
    "vary",
]
