"""Unit quaternions wxyz (…, 4), for numpy and torch alike."""

from __future__ import annotations

from omni_envs.tracking.array_api import Array, array_namespace, dot


def multiply(a: Array, b: Array) -> Array:
    """Returns the Hamilton product: first ``b``, then ``a``."""
    xp = array_namespace(a)
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    return xp.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        -1,
    )


def conjugate(q: Array) -> Array:
    """Returns the inverse rotations."""
    return array_namespace(q).concat([q[..., :1], -q[..., 1:]], -1)


def cross(a: Array, b: Array) -> Array:
    """Returns the cross products of (…, 3) vectors."""
    xp = array_namespace(a)
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return xp.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def rotate(q: Array, v: Array) -> Array:
    """Rotates (…, 3) vectors: v + 2w (u × v) + 2 u × (u × v) with q = (w, u)."""
    u = q[..., 1:]
    t = 2.0 * cross(u, v)
    return v + q[..., :1] * t + cross(u, t)


def rotate_inverse(q: Array, v: Array) -> Array:
    """Rotates (…, 3) vectors by the inverse rotations: world coordinates → body coordinates."""
    u = q[..., 1:]
    t = 2.0 * cross(u, v)
    return v - q[..., :1] * t + cross(u, t)


def matrix(q: Array) -> Array:
    """Returns the rotation matrices (…, 3, 3)."""
    xp = array_namespace(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    x2, y2, z2 = 2.0 * x, 2.0 * y, 2.0 * z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    entries = [
        *(1.0 - (yy + zz), xy - wz, xz + wy),
        *(xy + wz, 1.0 - (xx + zz), yz - wx),
        *(xz - wy, yz + wx, 1.0 - (xx + yy)),
    ]
    return xp.reshape(xp.stack(entries, -1), (*q.shape[:-1], 3, 3))


def rot6d(q: Array) -> Array:
    """Returns the first two **columns** of the matrices, flattened by rows: (r00, r01, r10, …).

    The order that BeyondMimic's observations use.
    """
    xp = array_namespace(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    x2, y2, z2 = 2.0 * x, 2.0 * y, 2.0 * z
    xy, wz, zz = x * y2, w * z2, z * z2
    return xp.stack(
        [
            1.0 - (y * y2 + zz),
            xy - wz,
            xy + wz,
            1.0 - (x * x2 + zz),
            x * z2 - w * y2,
            y * z2 + w * x2,
        ],
        -1,
    )


def angle(a: Array, b: Array) -> Array:
    """Returns the geodesic angles between rotations, rad in [0, π]."""
    return angle_of_dot(dot(a, b))


def angle_of_dot(cosine: Array) -> Array:
    """Returns the angles of relative rotations from the inner products of their quaternions."""
    xp = array_namespace(cosine)
    return 2.0 * xp.acos(xp.clip(xp.abs(cosine), 0.0, 1.0))


def yaw_only(q: Array) -> Array:
    """Returns (…, 4) the heading part: the rotation about z with the yaw of ``q`` (z-y-x angles)."""
    xp = array_namespace(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    half = 0.5 * xp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    zero = xp.zeros_like(half)
    return xp.stack([xp.cos(half), zero, zero, xp.sin(half)], -1)


def from_euler(rpy: Array) -> Array:
    """Returns the rotations of (…, 3) roll, pitch, yaw about the fixed x, y and z axes, in that order."""
    xp = array_namespace(rpy)
    c, s = xp.cos(0.5 * rpy), xp.sin(0.5 * rpy)
    cr, cp, cy = c[..., 0], c[..., 1], c[..., 2]
    sr, sp, sy = s[..., 0], s[..., 1], s[..., 2]
    return xp.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        -1,
    )


def projected_gravity_z(q: Array) -> Array:
    """Returns the z part of the unit gravity vector in the body frame: -1 upright, 1 upside down."""
    x, y = q[..., 1], q[..., 2]
    return 2.0 * (x * x + y * y) - 1.0
