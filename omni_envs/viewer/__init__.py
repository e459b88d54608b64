"""Eyes: picture strips and videos of references and rollouts, rendered offscreen."""

from omni_envs.viewer.pictures import picture_strip, write_picture, write_video
from omni_envs.viewer.reference import reference_frames, reference_strip, reference_video

__all__ = [
    "picture_strip",
    "reference_frames",
    "reference_strip",
    "reference_video",
    "write_picture",
    "write_video",
]
