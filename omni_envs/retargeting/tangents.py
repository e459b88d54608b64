"""Motions as configurations and the tangents between them."""

from __future__ import annotations

import numpy as np

from omni_envs import rotations


def difference(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(T, nv) tangents end ⊖ start of (T, 7 + n) configurations."""
    turn = rotations.difference(start[:, 3:7], end[:, 3:7])
    return np.hstack([end[:, :3] - start[:, :3], turn, end[:, 7:] - start[:, 7:]])


def motion_steps(qpos: np.ndarray) -> np.ndarray:
    """(T - 1, nv) tangents q_{t+1} ⊖ q_t of (T, 7 + n) configurations."""
    return difference(qpos[:-1], qpos[1:])


def moved(qpos: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(T, 7 + n) configurations q_t ⊕ x_t."""
    turned = rotations.multiply(qpos[:, 3:7], rotations.exp(x[:, 3:6]))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return np.hstack([qpos[:, :3] + x[:, :3], turned, qpos[:, 7:] + x[:, 6:]])
