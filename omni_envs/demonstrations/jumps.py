"""Jumps in a recording: swapped markers, lost frames."""

from __future__ import annotations

import numpy as np

SPEED = 10.0
"""Keypoints that are faster than this (m/s, human scale) for a step or two only have jumped."""

_RATIO = 4.0  # and so much faster than two steps before and after: fast limbs are not that sudden


def find_jumps(keypoints: np.ndarray, fps: float, scale: float = 1.0) -> np.ndarray:
    """Finds steps that no body makes.

    Args:
        keypoints: (T, K, 3) m.
        fps: Frames per second.
        scale: Size of this body / size of a human.

    Returns:
        (J, 2) frame that a jump leads to, and the keypoint that jumps.
    """
    speed = np.linalg.norm(np.diff(keypoints, axis=0), axis=-1) * fps / scale
    padded = np.pad(speed, ((2, 2), (0, 0)))
    calm = np.maximum(padded[:-4], padded[4:])
    frames, joints = np.nonzero((speed > SPEED) & (speed > _RATIO * calm))
    return np.stack([frames + 1, joints], axis=1)
