"""How good a robot motion is."""

from omni_envs.metrics.report import STANCE_MODES, ReferenceReport

__all__ = ["STANCE_MODES", "ReferenceReport"]
