"""Robot motion out: references, their files and their cache."""

from omni_envs.references.build import evaluate_reference, make_reference
from omni_envs.references.cache import cache_folder, cached_reference
from omni_envs.references.foreign import open_reference, reference_from_motion
from omni_envs.references.formats import MOTION_FORMATS, ForeignMotion, load_motion, save_motion
from omni_envs.references.key import reference_key
from omni_envs.references.kinematics import reference_from_qpos
from omni_envs.references.parallel import make_references
from omni_envs.references.picture import report_picture
from omni_envs.references.reference import Reference

__all__ = [
    "MOTION_FORMATS",
    "ForeignMotion",
    "Reference",
    "cache_folder",
    "cached_reference",
    "evaluate_reference",
    "load_motion",
    "make_reference",
    "make_references",
    "open_reference",
    "reference_from_motion",
    "reference_from_qpos",
    "reference_key",
    "report_picture",
    "save_motion",
]
