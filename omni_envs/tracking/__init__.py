"""The tracking task as plain functions on arrays, and its numbers as frozen dataclasses."""

from omni_envs.tracking.config import (
    OPTIONS,
    PHYSICS_PRESETS,
    PRESETS,
    ActionConfig,
    AdaptiveSampling,
    ObjectRandomization,
    ObservationConfig,
    ObservationNoise,
    PhysicsConfig,
    PushConfig,
    RandomizationConfig,
    ResetConfig,
    ResetNoise,
    RewardConfig,
    TerminationConfig,
    TrackingConfig,
    TrackingTerm,
    make_config,
)
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.observations import ObservationLayout, ObservationTerm

__all__ = [
    "OPTIONS",
    "PHYSICS_PRESETS",
    "PRESETS",
    "ActionConfig",
    "AdaptiveSampling",
    "MotionLibrary",
    "ObjectRandomization",
    "ObservationConfig",
    "ObservationLayout",
    "ObservationNoise",
    "ObservationTerm",
    "PhysicsConfig",
    "PushConfig",
    "RandomizationConfig",
    "ResetConfig",
    "ResetNoise",
    "RewardConfig",
    "TerminationConfig",
    "TrackingConfig",
    "TrackingTerm",
    "make_config",
]
