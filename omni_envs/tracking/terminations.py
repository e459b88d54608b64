"""Termination tests on (N, …) arrays: has the robot lost its reference?"""

from __future__ import annotations

from omni_envs.tracking import quaternion
from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.array_api import Array, array_namespace


def height_lost(position: Array, reference: Array, threshold: float) -> Array:
    """Returns (N,) whether |Δz| of (N, 3) positions exceeds the threshold, m."""
    return array_namespace(position).abs(position[:, 2] - reference[:, 2]) > threshold


def tilt_lost(orientation: Array, reference: Array, threshold: float) -> Array:
    """Returns (N,) whether the z parts of projected gravity of (N, 4) orientations differ too much.

    The threshold has no unit; it is not an angle. Heading does not matter.
    """
    tilt = quaternion.projected_gravity_z(orientation) - quaternion.projected_gravity_z(reference)
    return array_namespace(orientation).abs(tilt) > threshold


def any_height_lost(robot: Bodies, reference: Bodies, bodies: Array, threshold: float) -> Array:
    """Returns (N,) whether |Δz| of any of the given bodies exceeds the threshold, m.

    Re-alignment leaves heights alone, so the reference is taken as it is.
    """
    xp = array_namespace(robot.position)
    difference = robot.position[:, bodies, 2] - reference.position[:, bodies, 2]
    return xp.any(xp.abs(difference) > threshold, axis=-1)


def object_lost(
    squared_distance: Array, squared_angle: Array, distance: float, angle: float
) -> Array:
    """Returns (N,) whether the object is too far from its reference, in position or orientation.

    Args:
        squared_distance: (N,) m².
        squared_angle: (N,) rad².
        distance: Threshold, m.
        angle: Threshold, rad.
    """
    return (squared_distance > distance**2) | (squared_angle > angle**2)
