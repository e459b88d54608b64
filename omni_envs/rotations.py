"""Unit quaternions wxyz as arrays (…, 4): products, tangent vectors, interpolation."""

from __future__ import annotations

import numpy as np


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns the Hamilton product of (…, 4) quaternions: first ``b``, then ``a``."""
    aw, ax, ay, az = np.moveaxis(np.asarray(a), -1, 0)
    bw, bx, by, bz = np.moveaxis(np.asarray(b), -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def conjugate(q: np.ndarray) -> np.ndarray:
    """Returns the inverse rotation of (…, 4) unit quaternions."""
    return np.asarray(q) * np.array([1.0, -1.0, -1.0, -1.0])


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rotates (…, 3) vectors by (…, 4) unit quaternions."""
    w, u = q[..., :1], q[..., 1:]
    t = 2.0 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


def log(q: np.ndarray) -> np.ndarray:
    """Returns the (…, 3) rotation vectors, at most π long, of (…, 4) unit quaternions."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    # angle / sine → 2 as the angle vanishes.
    factor = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 1e-12)
    return factor * q[..., 1:]


def exp(v: np.ndarray) -> np.ndarray:
    """Returns the (…, 4) unit quaternions of (…, 3) rotation vectors; the inverse of ``log``."""
    v = np.asarray(v, float)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    # np.sinc(x) = sin(πx) / (πx).
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * v], axis=-1)


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns the (…, 3) rotation vectors from ``a`` to ``b``, in the frame of both."""
    return log(multiply(conjugate(a), b))


def slerp(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Interpolates (…, 4) unit quaternions on the short arc: ``a`` at weight 0, ``b`` at 1."""
    return multiply(a, exp(np.asarray(weight)[..., None] * difference(a, b)))
