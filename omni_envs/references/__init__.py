"""Robot motion out: references, their files and their cache."""

from omni_envs.references.kinematics import reference_from_qpos
from omni_envs.references.reference import Reference

__all__ = ["Reference", "reference_from_qpos"]
