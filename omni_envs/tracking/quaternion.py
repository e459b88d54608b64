"""Unit quaternions wxyz (…, 4), for numpy and torch alike.

Products and rotation matrices are bilinear in their quaternions: all products of entries, a (…, 16)
array, times a constant table. That is two array operations, where writing the entries out takes
thirty.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from omni_envs.tracking.array_api import Array, array_namespace, dot


def _product_table() -> np.ndarray:
    """(16, 4): a_i b_j in row 4 i + j to the entries of the Hamilton product."""
    signs = [
        [(0, 1), (1, 1), (2, 1), (3, 1)],
        [(1, 1), (0, -1), (3, 1), (2, -1)],
        [(2, 1), (3, -1), (0, -1), (1, 1)],
        [(3, 1), (2, 1), (1, -1), (0, -1)],
    ]
    table = np.zeros((4, 4, 4))
    for i, row in enumerate(signs):
        for j, (k, sign) in enumerate(row):
            table[i, j, k] = sign
    return table.reshape(16, 4)


def _matrix_table() -> np.ndarray:
    """(16, 9): q_i q_j in row 4 i + j to the entries of the rotation matrix, by rows."""
    entries = [
        {(0, 0): 1, (1, 1): 1, (2, 2): -1, (3, 3): -1},
        {(1, 2): 2, (0, 3): -2},
        {(1, 3): 2, (0, 2): 2},
        {(1, 2): 2, (0, 3): 2},
        {(0, 0): 1, (1, 1): -1, (2, 2): 1, (3, 3): -1},
        {(2, 3): 2, (0, 1): -2},
        {(1, 3): 2, (0, 2): -2},
        {(2, 3): 2, (0, 1): 2},
        {(0, 0): 1, (1, 1): -1, (2, 2): -1, (3, 3): 1},
    ]
    table = np.zeros((4, 4, 9))
    for k, entry in enumerate(entries):
        for (i, j), value in entry.items():
            table[i, j, k] = value
    return table.reshape(16, 9)


_PRODUCT, _MATRIX = _product_table(), _matrix_table()
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
# b* in place of b: the rows of b's vector part change sign.
_PRODUCT_CONJUGATE = _PRODUCT * np.tile(_CONJUGATE, 4)[:, None]
_CONJUGATE_PRODUCT = _PRODUCT * np.repeat(_CONJUGATE, 4)[:, None]
_ROT6D = _MATRIX[:, [0, 1, 3, 4, 6, 7]]
_TABLES = {
    "product": _PRODUCT,
    "product_conjugate": _PRODUCT_CONJUGATE,
    "conjugate_product": _CONJUGATE_PRODUCT,
    "matrix": _MATRIX,
    "rot6d": _ROT6D,
    "conjugate": _CONJUGATE,
}


@lru_cache(maxsize=64)
def _table(name: str, xp: Any, dtype: Any, device: Any) -> Array:
    return xp.asarray(_TABLES[name], dtype=dtype, device=device)


def _bilinear(name: str, a: Array, b: Array) -> Array:
    products = a[..., :, None] * b[..., None, :]
    table = _table(name, array_namespace(a), products.dtype, products.device)
    return products.reshape((*products.shape[:-2], 16)) @ table


def multiply(a: Array, b: Array) -> Array:
    """Returns the Hamilton products a ⊗ b: first ``b``, then ``a``."""
    return _bilinear("product", a, b)


def multiply_conjugate(a: Array, b: Array) -> Array:
    """Returns a ⊗ b*: the rotations that take ``b`` to ``a``, in the frame both are given in."""
    return _bilinear("product_conjugate", a, b)


def conjugate_multiply(a: Array, b: Array) -> Array:
    """Returns a* ⊗ b: ``b`` as seen from ``a``."""
    return _bilinear("conjugate_product", a, b)


def conjugate(q: Array) -> Array:
    """Returns the inverse rotations."""
    return q * _table("conjugate", array_namespace(q), q.dtype, q.device)


def matrix(q: Array) -> Array:
    """Returns the rotation matrices (…, 3, 3)."""
    return _bilinear("matrix", q, q).reshape((*q.shape[:-1], 3, 3))


def rot6d(q: Array) -> Array:
    """Returns the first two **columns** of the matrices, flattened by rows: (r00, r01, r10, …).

    The order that BeyondMimic's observations use.
    """
    return _bilinear("rot6d", q, q)


def rotate(q: Array, v: Array) -> Array:
    """Rotates (…, 3) vectors."""
    return (matrix(q) @ v[..., None])[..., 0]


def rotate_inverse(q: Array, v: Array) -> Array:
    """Rotates (…, 3) vectors by the inverse rotations: world coordinates → body coordinates."""
    return (v[..., None, :] @ matrix(q))[..., 0, :]


def dot_turned(a: Array, b: Array) -> Array:
    """Returns the inner products <a, k ⊗ b> with k = (0, 0, 0, 1), half a turn about z.

    k ⊗ b = (-b_z, -b_y, b_x, b_w).
    """
    forward = a[..., 3] * b[..., 0] + a[..., 2] * b[..., 1]
    return forward - a[..., 1] * b[..., 2] - a[..., 0] * b[..., 3]


def angle(a: Array, b: Array) -> Array:
    """Returns the geodesic angles between rotations, rad in [0, π]."""
    return angle_of_dot(dot(a, b))


def angle_of_dot(cosine: Array) -> Array:
    """Returns the angles of relative rotations from the inner products of their quaternions."""
    xp = array_namespace(cosine)
    return 2.0 * xp.acos(xp.clip(xp.abs(cosine), None, 1.0))


def half_yaw(q: Array) -> Array:
    """Returns (…,) half the yaw of rotations (z-y-x angles), rad."""
    xp = array_namespace(q)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return 0.5 * xp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def yaw_only(q: Array) -> Array:
    """Returns (…, 4) the heading part: the rotations about z by the yaw of ``q``."""
    xp = array_namespace(q)
    half = half_yaw(q)
    zero = xp.zeros_like(half)
    return xp.stack([xp.cos(half), zero, zero, xp.sin(half)], -1)


def from_euler(rpy: Array) -> Array:
    """Returns the rotations of (…, 3) roll, pitch, yaw about the fixed x, y, z axes."""
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
    """Returns the z part of the unit gravity vector in the body frame: -1 upright, 1 inverted."""
    x, y = q[..., 1], q[..., 2]
    return 2.0 * (x * x + y * y) - 1.0
