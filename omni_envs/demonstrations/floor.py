"""Finding the ground under a recorded person."""

from __future__ import annotations

import numpy as np

from omni_envs.demonstrations.stance import stance_schedule

_MIN_SPREAD = 1.0  # m of walked ground from which a slope can be told
_MAX_UNEVEN = 0.02  # m of spread about the plane; more is steps that were not recorded
_MAX_SLOPE = np.tan(np.deg2rad(2.0))  # more is a slope in the scene, not an error of calibration


def level_floor(positions: np.ndarray, toes: np.ndarray, fps: float) -> np.ndarray:
    """Takes out a slight tilt of the recorded ground.

    Optical motion capture is often calibrated with a floor that is tilted by up to a degree, which
    is 10 cm after a walk of 6 m. A plane through the standing toes (each foot with its own height)
    gives the tilt; heights are sheared by it, so nothing else changes. Without enough walked ground
    along a direction, beyond 2°, or where feet do not stand on one plane (boxes that were not
    recorded), that direction is left alone.

    Args:
        positions: (T, J, 3) joints, m, z up.
        toes: (T, 2, 3) toes of both feet.
        fps: Frames per second.

    Returns:
        (T, J, 3) joints over level ground.
    """
    stance = np.column_stack([stance_schedule(toes[:, foot], fps) for foot in range(2)])
    frame, foot = np.nonzero(stance)
    if len(frame) < 10:
        return positions
    points = toes[frame, foot]
    centred = points.copy()
    for f in np.unique(foot):
        centred[foot == f] -= points[foot == f].mean(axis=0)
    directions, spread, _ = np.linalg.svd(centred[:, :2].T, full_matrices=False)
    levelled = np.array(positions)
    for direction, size in zip(directions.T, spread / np.sqrt(len(points)), strict=True):
        along = centred[:, :2] @ direction
        slope = along @ centred[:, 2] / (along @ along) if size > 0 else 0.0
        flat = np.std(centred[:, 2] - slope * along) <= _MAX_UNEVEN
        if np.ptp(along) >= _MIN_SPREAD and abs(slope) <= _MAX_SLOPE and flat:
            levelled[..., 2] -= slope * (
                (positions[..., :2] - points[:, :2].mean(axis=0)) @ direction
            )
    return levelled
