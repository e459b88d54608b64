"""Pulls that grow before a contact, and fade after it: none is sudden."""

from __future__ import annotations

import numpy as np

_RAMP = 0.1  # s


def ramps(touching: np.ndarray, fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights in [0, 1], and the frame whose contact pulls.

    Args:
        touching: (links, T) bool.
        fps: Frames per second.

    Returns:
        (links, T) 1 in contact, falling to 0 over 0.1 s around it; and (links, T) the nearest frame
        in contact, any frame where there is none near.
    """
    count, frames = touching.shape[1], round(_RAMP * fps)
    t = np.arange(count)
    weights, nearest = np.zeros(touching.shape), np.tile(t, (len(touching), 1))
    for weight, near, flags in zip(weights, nearest, touching, strict=True):
        known = np.flatnonzero(flags)
        if len(known):
            after = np.searchsorted(known, t)
            before = known[np.maximum(after - 1, 0)]
            after = known[np.minimum(after, len(known) - 1)]
            near[:] = np.where(np.abs(t - before) <= np.abs(t - after), before, after)
            weight[:] = np.maximum(1.0 - np.abs(t - near) / (frames + 1), 0.0)
    return weights, nearest
