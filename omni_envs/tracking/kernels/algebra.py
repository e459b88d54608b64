"""Vectors, quaternions (wxyz) and rotation matrices as tuples of numbers, and rows of arrays."""

from __future__ import annotations

from math import acos

from omni_envs.tracking.kernels.compiled import Array, Tuple, compiled


@compiled
def product(a: Tuple, b: Tuple) -> Tuple:
    """The product of two quaternions."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@compiled
def conjugate(q: Tuple) -> Tuple:
    """The inverse of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


@compiled
def matrix(q: Tuple) -> Tuple:
    """The nine entries, by rows, of the rotation matrix of a quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (
        w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z,
    )  # fmt: skip


@compiled
def rotate(m: Tuple, v: Tuple) -> Tuple:
    """The matrix m times v."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@compiled
def rotate_inverse(m: Tuple, v: Tuple) -> Tuple:
    """The transpose of the matrix m times v."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@compiled
def cross(a: Tuple, b: Tuple) -> Tuple:
    """The cross product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def triple(values: Array, i: int, start: int) -> Tuple:
    """Three columns of row i."""
    return (values[i, start], values[i, start + 1], values[i, start + 2])


@compiled
def quadruple(values: Array, i: int, start: int) -> Tuple:
    """Four columns of row i."""
    return (values[i, start], values[i, start + 1], values[i, start + 2], values[i, start + 3])


@compiled
def vector_of(values: Array, i: int, b: int) -> Tuple:
    """Row (i, b) of (N, B, 3) values."""
    return (values[i, b, 0], values[i, b, 1], values[i, b, 2])


@compiled
def quaternion_of(values: Array, i: int, b: int) -> Tuple:
    """Row (i, b) of (N, B, 4) values."""
    return (values[i, b, 0], values[i, b, 1], values[i, b, 2], values[i, b, 3])


@compiled
def squared_distance(a: Tuple, b: Tuple) -> float:
    """The squared distance of two points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@compiled
def squared_angle(dot: float) -> float:
    """The squared angle, rad², between quaternions with that dot product."""
    angle = 2.0 * acos(min(abs(dot), 1.0))
    return angle * angle


@compiled
def dot(a: Tuple, b: Tuple) -> float:
    """The dot product of two quaternions."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@compiled
def gravity_z(q: Tuple) -> float:
    """The z part of gravity's direction seen by a body."""
    return 2.0 * (q[1] * q[1] + q[2] * q[2]) - 1.0


@compiled
def write_rot6d(out: Array, i: int, start: int, m: Tuple) -> int:
    """Writes two columns of a matrix, by rows, into row i; returns where they end."""
    out[i, start], out[i, start + 1], out[i, start + 2] = m[0], m[1], m[3]
    out[i, start + 3], out[i, start + 4], out[i, start + 5] = m[4], m[6], m[7]
    return start + 6


@compiled
def write(out: Array, i: int, start: int, v: Tuple) -> int:
    """Writes numbers into row i; returns where they end."""
    for k in range(len(v)):
        out[i, start + k] = v[k]
    return start + len(v)


@compiled
def copy_columns(
    out: Array, i: int, start: int, source: Array, row: int, first: int, count: int
) -> int:
    """Copies columns of a row into row i; returns where they end."""
    for k in range(count):
        out[i, start + k] = source[row, first + k]
    return start + count
