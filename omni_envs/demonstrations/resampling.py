"""Bringing joint positions to a common frame rate."""

from __future__ import annotations

import numpy as np

from omni_envs.resampling import frame_grid

FPS = 30.0
"""Frame rate of demonstrations made from faster recordings."""


def whole_step(fps: float, target_fps: float = FPS) -> int:
    """The n for which every n-th frame has the target rate; 0 where there is none.

    Rates are often written with few digits: 0.1 % off is whole.
    """
    step = fps / target_fps
    whole = round(step)
    return whole if whole >= 1 and abs(step - whole) < 1e-3 * step else 0


def resample_positions(positions: np.ndarray, fps: float, target_fps: float = FPS) -> np.ndarray:
    """Resamples (T, …) positions from ``fps`` to ``target_fps``.

    A whole ratio takes every n-th frame, so that nothing is smoothed. Any other ratio interpolates
    linearly between recorded frames. Time starts at the first frame.
    """
    whole = whole_step(fps, target_fps)
    if whole:
        return positions[::whole]
    left, weight = frame_grid(len(positions), fps, target_fps)
    right = np.minimum(left + 1, len(positions) - 1)
    weight = weight.reshape(-1, *[1] * (positions.ndim - 1))
    return (1 - weight) * positions[left] + weight * positions[right]
