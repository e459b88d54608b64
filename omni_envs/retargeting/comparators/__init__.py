"""Other methods, written again from their descriptions, to compare with."""

from omni_envs.retargeting.comparators.gmr import GMR_MATCHES, GmrMotion, gmr_retarget

__all__ = ["GMR_MATCHES", "GmrMotion", "gmr_retarget"]
