"""Bodies of robot and reference, and the re-alignment of one to the other at the anchor."""

from __future__ import annotations

from typing import NamedTuple

from omni_envs.tracking import quaternion
from omni_envs.tracking.array_api import Array, array_namespace


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


def body_twists(position: Array, twist: Array, centre_of_mass: Array) -> tuple[Array, Array]:
    """Moves MuJoCo's body velocities from the tree's centre of mass to the body origins.

    Args:
        position: (N, B, 3) body origins.
        twist: (N, B, 6) MuJoCo's ``cvel``: angular, then linear velocity at the centre of mass.
        centre_of_mass: (N, 3) of the kinematic tree.

    Returns:
        Linear (N, B, 3) and angular (N, B, 3) velocities in the world.
    """
    angular = twist[..., :3]
    arm = position - centre_of_mass[:, None, :]
    return twist[..., 3:] + quaternion.cross(angular, arm), angular


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
        cosine, sine = (c * c - s * s)[:, None], (2.0 * c * s)[:, None]
        arm = position - self.pivot[:, None, :]
        x, y = arm[..., 0], arm[..., 1]
        turned = xp.stack([cosine * x - sine * y, sine * x + cosine * y, arm[..., 2]], -1)
        return turned + self.origin[:, None, :]

    def quaternions(self, q: Array) -> Array:
        """Returns the re-aligned orientations of (N, B, 4) reference orientations."""
        c, s = self.half_cosine[:, None, None], self.half_sine[:, None, None]
        return c * q + s * turned_about_z(q)


def turned_about_z(q: Array) -> Array:
    """Returns k ⊗ q with k = (0, 0, 0, 1): half a turn about the world's z axis after ``q``."""
    xp = array_namespace(q)
    return xp.stack([-q[..., 3], -q[..., 2], q[..., 1], q[..., 0]], -1)


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
    turn = quaternion.multiply(orientation, quaternion.conjugate(reference_orientation))
    delta = quaternion.yaw_only(turn)
    origin = xp.concat([position[:, :2], reference_position[:, 2:]], -1)
    return Alignment(delta[:, 0], delta[:, 3], origin, reference_position)
