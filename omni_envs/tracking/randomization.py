"""Draws of what differs between episodes: start states, pushes, default poses, object inertia."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omni_envs.tracking import quaternion
from omni_envs.tracking.config import PushConfig, ResetNoise


def symmetric(rng: np.random.Generator, count: int, half_widths: Sequence[float]) -> np.ndarray:
    """Returns (count, len(half_widths)) uniform draws from ± the half widths."""
    width = np.asarray(half_widths, float)
    return (2.0 * rng.random((count, len(width))) - 1.0) * width


def start_state(
    qpos: np.ndarray,
    qvel: np.ndarray,
    noise: ResetNoise | None,
    lower: np.ndarray,
    upper: np.ndarray,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Disturbs start states.

    Args:
        qpos: (K, nq) robot 7 + n, then possibly the object's 7.
        qvel: (K, nv) MuJoCo velocities, angular parts of free joints in the body frame.
        noise: What to add, or None.
        lower: (n,) soft lower joint limits, rad.
        upper: (n,) soft upper joint limits, rad.
        rng: Source of chance.

    Returns:
        Fresh qpos and qvel. The root is turned about the world's axes and keeps its angular velocity
        in the world but for the noise.
    """
    qpos, qvel = qpos.copy(), qvel.copy()
    if noise is None:
        return qpos, qvel
    count, n = len(qpos), len(lower)
    root, joints = qpos[:, 3:7], slice(7, 7 + n)
    spin = quaternion.rotate(root, qvel[:, 3:6])
    spin += symmetric(rng, count, noise.root_angular_velocity)
    turn = quaternion.from_euler(symmetric(rng, count, noise.root_orientation))
    root = quaternion.multiply(turn, root)
    qpos[:, :3] += symmetric(rng, count, noise.root_position)
    qpos[:, 3:7] = root
    qvel[:, :3] += symmetric(rng, count, noise.root_linear_velocity)
    qvel[:, 3:6] = quaternion.rotate_inverse(root, spin)
    disturbed = qpos[:, joints] + symmetric(rng, count, [noise.joint_position] * n)
    qpos[:, joints] = np.clip(disturbed, lower, upper)
    if qpos.shape[1] > 7 + n:
        qpos[:, 7 + n : 10 + n] += symmetric(rng, count, noise.object_position)
    return qpos, qvel


def push(root_quaternion: np.ndarray, config: PushConfig, rng: np.random.Generator) -> np.ndarray:
    """Draws pushes.

    Args:
        root_quaternion: (K, 4).
        config: How hard.
        rng: Source of chance.

    Returns:
        (K, 6) to add to the velocity of the root's free joint: linear in the world, angular in the body
        frame, drawn about the world's axes.
    """
    count = len(root_quaternion)
    linear, spin = symmetric(rng, count, config.linear), symmetric(rng, count, config.angular)
    return np.concatenate([linear, quaternion.rotate_inverse(root_quaternion, spin)], axis=1)


def scaled_inertia(inertia: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Stretches a body of constant mass.

    The second moments Σ = ½ tr(I) 1 - I of the mass scale as S Σ S; a tensor made this way stays
    physically valid.

    Args:
        inertia: (3, 3) inertia about the centre of mass, kg m².
        scale: (3,) factors along the axes that the inertia is given in.

    Returns:
        (3, 3) inertia of the stretched body.
    """
    moments = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    stretched = moments * np.outer(scale, scale)
    return np.trace(stretched) * np.eye(3) - stretched
