"""Bringing joint positions to a common frame rate."""

from __future__ import annotations

import numpy as np

FPS = 30.0
"""Frame rate of demonstrations made from faster recordings."""


def resample_positions(positions: np.ndarray, fps: float, target_fps: float = FPS) -> np.ndarray:
    """Resamples (T, …, 3) positions from ``fps`` to ``target_fps``.

    A whole ratio takes every n-th frame, so that nothing is smoothed (rates are
    often written with few digits: 0.1 % off is whole). Any other
    ratio interpolates linearly between recorded frames. Time starts at the first frame.
    """
    step = fps / target_fps
    if abs(step - round(step)) < 1e-3 * step and round(step) >= 1:
        return positions[:: round(step)]
    frames = len(positions)
    times = np.arange(0.0, frames - 1 + 1e-9, step)
    first = np.minimum(times.astype(int), max(frames - 2, 0))
    weight = (times - first).reshape(-1, *[1] * (positions.ndim - 1))
    following = positions[np.minimum(first + 1, frames - 1)]
    return (1 - weight) * positions[first] + weight * following
