"""Human motion → robot motion under hard constraints."""

from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.options import RetargetOptions, StanceOptions
from omni_envs.retargeting.refine import RefineOptions, refine
from omni_envs.retargeting.result import RELAXATIONS, Retargeted, SolveRecord
from omni_envs.retargeting.retarget import deformation_energy, retarget

__all__ = [
    "RELAXATIONS",
    "InteractionMesh",
    "RefineOptions",
    "RetargetOptions",
    "Retargeted",
    "SolveRecord",
    "StanceOptions",
    "deformation_energy",
    "refine",
    "retarget",
]
