"""Bodies of robot and reference, and the re-alignment of one to the other at the anchor."""

from __future__ import annotations

from typing import NamedTuple

from omni_envs.tracking import quaternion
from omni_envs.tracking.array_api import Array, array_namespace, dot


class Bodies(NamedTuple):
    """World poses and velocities of the B tracked bodies in N simulations.

    Attributes:
        position: (N, B, 3) origins, m.
        quaternion: (N, B, 4) wxyz.
        linear_velocity: (N, B, 3) of the origins, m/s.
        angular_velocity: (N, B, 3) rad/s.
    """

    position: Array
    quaternion: Array
    linear_velocity: Array
    angular_velocity: Array


class Alignment(NamedTuple):
    """The rigid motion that forgives drift in x, y and yaw.

    A reference body b maps to p' = o + Δ (p_b - p_a), q' = Δ q_b with the heading correction
    Δ = yaw(q_robot,a q_ref,a⁻¹) and the origin o = (x_robot,a, y_robot,a, z_ref,a).

    Attributes:
        half_cosine: (N,) w of the quaternion Δ.
        half_sine: (N,) z of the quaternion Δ.
        origin: (N, 3) o.
        pivot: (N, 3) p_a of the reference.
    """

    half_cosine: Array
    half_sine: Array
    origin: Array
    pivot: Array

    def positions(self, position: Array) -> Array:
        """Returns the re-aligned positions of (N, B, 3) reference positions."""
        xp = array_namespace(position)
        c, s = self.half_cosine, self.half_sine
        cosine, sine, zero = c * c - s * s, 2.0 * c * s, xp.zeros_like(c)
        rows = [cosine, sine, zero, -sine, cosine, zero, zero, zero, zero + 1.0]
        transposed = xp.reshape(xp.stack(rows, -1), (*c.shape, 3, 3))
        offset = self.origin[:, None, :] - self.pivot[:, None, :] @ transposed
        return position @ transposed + offset

    def quaternions(self, q: Array) -> Array:
        """Returns the re-aligned orientations of (N, B, 4) reference orientations."""
        xp = array_namespace(q)
        zero = xp.zeros_like(self.half_cosine)
        delta = xp.stack([self.half_cosine, zero, zero, self.half_sine], -1)
        return quaternion.multiply(delta[:, None, :], q)

    def angle(self, q: Array, reference: Array) -> Array:
        """Returns (N, B) angles between orientations q and q' of (N, B, 4) arrays, rad.

        <q, Δ r> = c <q, r> + s <q, k r> with k = (0, 0, 0, 1).
        """
        c, s = self.half_cosine[:, None], self.half_sine[:, None]
        return quaternion.angle_of_dot(
            c * dot(q, reference) + s * quaternion.dot_turned(q, reference)
        )


def align(
    position: Array, orientation: Array, reference_position: Array, reference_orientation: Array
) -> Alignment:
    """Finds the re-alignment of a reference to a robot.

    Args:
        position: (N, 3) of the robot's anchor body.
        orientation: (N, 4) of the robot's anchor body.
        reference_position: (N, 3) of the reference's anchor body.
        reference_orientation: (N, 4) of the reference's anchor body.
    """
    xp = array_namespace(position)
    half = quaternion.half_yaw(quaternion.multiply_conjugate(orientation, reference_orientation))
    origin = xp.concat([position[:, :2], reference_position[:, 2:]], -1)
    return Alignment(xp.cos(half), xp.sin(half), origin, reference_position)
