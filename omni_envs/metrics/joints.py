"""What the joints do: limits and smoothness."""

from __future__ import annotations

import numpy as np

from omni_envs.robots import Robot


def joint_violation(robot: Robot, joints: np.ndarray) -> np.ndarray:
    """Returns the (T,) largest excess of (T, n) joint positions over the mechanical ranges, rad."""
    low, high = robot.joint_ranges.T
    return np.maximum(np.maximum(low - joints, joints - high), 0.0).max(axis=1)


def joint_speeds(joints: np.ndarray, fps: float) -> np.ndarray:
    """Returns the (T, n) joint speeds since the previous frame, rad/s, 0 on the first."""
    speeds = np.zeros_like(joints)
    speeds[1:] = np.abs(np.diff(joints, axis=0)) * fps
    return speeds


def velocity_violation(robot: Robot, speeds: np.ndarray) -> np.ndarray:
    """Returns the (T,) largest excess of (T, n) joint speeds over the actuators' limits, rad/s."""
    return np.maximum(speeds - robot.velocity_limits, 0.0).max(axis=1)


def joint_acceleration(joints: np.ndarray, fps: float) -> np.ndarray:
    """Returns the (T,) root mean square of second differences, rad/s², NaN at the ends."""
    out = np.full(len(joints), np.nan)
    if len(joints) > 2:
        out[1:-1] = _rms(np.diff(joints, n=2, axis=0) * fps**2)
    return out


def joint_jerk(joints: np.ndarray, fps: float) -> np.ndarray:
    """Returns the (T,) root mean square of third differences, rad/s³, NaN at the ends."""
    out = np.full(len(joints), np.nan)
    if len(joints) > 3:
        out[2:-1] = _rms(np.diff(joints, n=3, axis=0) * fps**3)
    return out


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values**2, axis=1))
