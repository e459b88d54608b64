"""Reward terms on (N, …) arrays: w · exp(-e / σ²) for tracking, weighted counts for penalties."""

from __future__ import annotations

from typing import NamedTuple

from omni_envs.tracking import quaternion
from omni_envs.tracking.alignment import Alignment, Bodies
from omni_envs.tracking.array_api import Array, array_namespace, dot

TRACKING_TERMS = (
    "anchor_position",
    "anchor_orientation",
    "body_position",
    "body_orientation",
    "body_linear_velocity",
    "body_angular_velocity",
    "object_position",
    "object_orientation",
)
"""Names of the tracking terms; those of the object are absent without one."""

PENALTY_TERMS = ("action_rate", "joint_limit", "contact")
"""Names of the penalties."""


class TrackingErrors(NamedTuple):
    """Squared errors of the tracking terms, (N,) each; body errors are means over the bodies."""

    anchor_position: Array
    anchor_orientation: Array
    body_position: Array
    body_orientation: Array
    body_linear_velocity: Array
    body_angular_velocity: Array
    object_position: Array | None = None
    object_orientation: Array | None = None


def squared_distance(a: Array, b: Array) -> Array:
    """Returns (…,) squared distances of (…, 3) points."""
    difference = a - b
    return dot(difference, difference)


def mean_squared_distance(a: Array, b: Array) -> Array:
    """Returns (N,) means over the bodies of the squared distances of (N, B, 3) vectors."""
    xp = array_namespace(a)
    difference = xp.reshape(a - b, (a.shape[0], -1))
    return dot(difference, difference) / a.shape[1]


def tracking_errors(
    robot: Bodies,
    reference: Bodies,
    alignment: Alignment,
    anchor: int,
    object_pose: Array | None = None,
    reference_object_pose: Array | None = None,
    orientation_bodies: Array | None = None,
) -> TrackingErrors:
    """Compares robot and reference.

    Anchor and object errors are in the world. Body positions and orientations are compared with the
    re-aligned reference, velocities with the reference as it is.

    Args:
        robot: The robot's bodies.
        reference: The reference's bodies.
        alignment: Re-alignment of the reference to this state of the robot.
        anchor: Index of the anchor body.
        object_pose: (N, 7) pose of the object.
        reference_object_pose: (N, 7) pose of the reference's object.
        orientation_bodies: Indices of the bodies whose orientation counts, all by default.
    """
    q, r = robot.quaternion, reference.quaternion
    anchor_angle = quaternion.angle(q[:, anchor], r[:, anchor])
    if orientation_bodies is not None:
        q, r = q[:, orientation_bodies], r[:, orientation_bodies]
    angles = alignment.angle(q, r)
    object_distance = object_angle = None
    if object_pose is not None and reference_object_pose is not None:
        object_distance = squared_distance(object_pose[:, :3], reference_object_pose[:, :3])
        turn = quaternion.angle(object_pose[:, 3:], reference_object_pose[:, 3:])
        object_angle = turn * turn
    return TrackingErrors(
        anchor_position=squared_distance(robot.position[:, anchor], reference.position[:, anchor]),
        anchor_orientation=anchor_angle * anchor_angle,
        body_position=mean_squared_distance(
            robot.position, alignment.positions(reference.position)
        ),
        body_orientation=dot(angles, angles) / angles.shape[1],
        body_linear_velocity=mean_squared_distance(
            robot.linear_velocity, reference.linear_velocity
        ),
        body_angular_velocity=mean_squared_distance(
            robot.angular_velocity, reference.angular_velocity
        ),
        object_position=object_distance,
        object_orientation=object_angle,
    )


def tracking_reward(squared_error: Array, sigma: float) -> Array:
    """Returns exp(-e / σ²) in [0, 1]."""
    return array_namespace(squared_error).exp(squared_error * (-1.0 / sigma**2))


def action_rate(action: Array, previous: Array) -> Array:
    """Returns (N,) squared changes of (N, n) raw actions between two control steps."""
    change = action - previous
    return dot(change, change)


def joint_limit_excess(joint_position: Array, lower: Array, upper: Array) -> Array:
    """Returns (N,) sums of the excess of (N, n) joint positions over soft limits (n,), rad."""
    xp = array_namespace(joint_position)
    outside = xp.maximum(joint_position - upper, lower - joint_position)
    # Half of x + |x| is the positive part.
    return 0.5 * xp.sum(outside + xp.abs(outside), axis=-1)


def bodies_in_contact(force: Array, threshold: float) -> Array:
    """Counts bodies with a contact force above a threshold in any substep.

    Args:
        force: (N, bodies, substeps, 3) contact forces, N.
        threshold: N.

    Returns:
        (N,) counts.
    """
    xp = array_namespace(force)
    return xp.sum(xp.any(_strong(force, threshold), axis=-1), axis=-1)


def substeps_in_contact(force: Array, threshold: float) -> Array:
    """Counts substeps with a contact force above a threshold on any body.

    Args:
        force: (N, bodies, substeps, 3) contact forces, N.
        threshold: N.

    Returns:
        (N,) counts.
    """
    xp = array_namespace(force)
    return xp.sum(xp.any(_strong(force, threshold), axis=-2), axis=-1)


def _strong(force: Array, threshold: float) -> Array:
    x, y, z = force[..., 0], force[..., 1], force[..., 2]
    return x * x + y * y + z * z > threshold**2
