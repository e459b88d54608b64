"""Changing the frame rate of motions on their own manifolds."""

from __future__ import annotations

import numpy as np

from omni_envs import rotations
from omni_envs.errors import InvalidDataError


def resample_poses(poses: np.ndarray, fps: float, new_fps: float) -> np.ndarray:
    """Resamples poses: positions and hinges linearly, the quaternion on the short arc.

    New frames are at k / ``new_fps`` as far as the old ones reach; the last old frame is kept when
    it falls on that grid. Pure interpolation: contacts and planted feet are kept only as far as
    they are linear.

    Args:
        poses: (T, 7 + n) position, quaternion wxyz, n hinges; qpos of a robot, or with n = 0 an
            object.
        fps: Frames per second of ``poses``.
        new_fps: Frames per second of the result.

    Returns:
        (T', 7 + n).

    Raises:
        InvalidDataError: A frame rate is not positive, or the array has another shape.
    """
    if np.ndim(poses) != 2 or np.shape(poses)[1] < 7 or len(poses) < 1:
        raise InvalidDataError("Poses", "shape", "(T, 7 + n)", str(np.shape(poses)))
    left, weight = frame_grid(len(poses), fps, new_fps)
    right = np.minimum(left + 1, len(poses) - 1)
    a, b = poses[left], poses[right]
    out = a + weight[:, None] * (b - a)
    out[:, 3:7] = rotations.slerp(a[:, 3:7], b[:, 3:7], weight)
    return out


def frame_grid(frames: int, fps: float, new_fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Places new frames between old ones.

    Args:
        frames: Number of old frames.
        fps: Their rate.
        new_fps: The rate of the new frames.

    Returns:
        (T',) the old frame before each new one, and (T',) the weight in [0, 1) of the old frame
        after it.

    Raises:
        InvalidDataError: A frame rate is not positive.
    """
    for name, value in (("fps", fps), ("new_fps", new_fps)):
        if not (np.isfinite(value) and value > 0):
            raise InvalidDataError("Resampling", name, "positive", str(value))
    # Frames that fall on the grid up to rounding are on it.
    count = int(np.floor((frames - 1) * new_fps / fps + 1e-6)) + 1
    place = np.arange(count) * (fps / new_fps)
    nearest = np.round(place)
    place = np.where(np.abs(place - nearest) < 1e-6, nearest, place)
    left = np.floor(place).astype(int)
    return left, place - left
