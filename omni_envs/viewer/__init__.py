"""Eyes: a page in the browser; strips and videos of references and rollouts, drawn offscreen."""

from omni_envs.viewer.page import ReferencePage
from omni_envs.viewer.pictures import picture_strip, write_picture, write_video
from omni_envs.viewer.reference import reference_frames, reference_strip, reference_video
from omni_envs.viewer.rollout import Rollout, watch

__all__ = [
    "ReferencePage",
    "Rollout",
    "picture_strip",
    "reference_frames",
    "reference_strip",
    "reference_video",
    "watch",
    "write_picture",
    "write_video",
]
