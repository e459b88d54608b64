"""Draws of what differs between episodes: start states, pushes, default poses, object inertia."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omni_envs.tracking import quaternion
from omni_envs.tracking.config import PushConfig, ResetNoise


def symmetric(
    rng: np.random.Generator, count: int, half_widths: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Returns (count, len(half_widths)) uniform draws from ± the half widths."""
    width = np.asarray(half_widths, float)
    return (2.0 * rng.random((count, len(width))) - 1.0) * width


def start_widths(noise: ResetNoise, joints: int) -> np.ndarray:
    """Returns (15 + n,) half widths in the order that start states are drawn in."""
    parts = (
        noise.root_position,
        noise.root_orientation,
        noise.root_linear_velocity,
        noise.root_angular_velocity,
        noise.object_position,
    )
    return np.concatenate([*parts, np.full(joints, noise.joint_position)])


def start_state(
    qpos: np.ndarray,
    qvel: np.ndarray,
    noise: ResetNoise | None,
    lower: np.ndarray,
    upper: np.ndarray,
    rng: np.random.Generator,
    share: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Disturbs start states.

    Args:
        qpos: (K, nq) robot 7 + n, then possibly the object's 7.
        qvel: (K, nv) MuJoCo velocities, angular parts of free joints in the body frame.
        noise: What to add, or None.
        lower: (n,) soft lower joint limits, rad.
        upper: (n,) soft upper joint limits, rad.
        rng: Source of chance.
        share: (K,) share of the noise that each start state gets, all of it by default.

    Returns:
        Fresh qpos and qvel. The root is turned about the world's axes and keeps its angular
        velocity in the world but for the noise.
    """
    qpos, qvel = qpos.copy(), qvel.copy()
    if noise is None:
        return qpos, qvel
    n = len(lower)
    draws = symmetric(rng, len(qpos), start_widths(noise, n))
    if share is not None:
        draws *= share[:, None]
    position, orientation, linear, spin, object_position = (
        draws[:, 3 * i : 3 * i + 3] for i in range(5)
    )
    turned = quaternion.multiply(quaternion.from_euler(orientation), qpos[:, 3:7])
    spin = spin + quaternion.rotate(qpos[:, 3:7], qvel[:, 3:6])
    qpos[:, :3] += position
    qpos[:, 3:7] = turned
    qvel[:, :3] += linear
    qvel[:, 3:6] = quaternion.rotate_inverse(turned, spin)
    joints = slice(7, 7 + n)
    qpos[:, joints] = np.clip(qpos[:, joints] + draws[:, 15:], lower, upper)
    qpos[:, 7 + n : 10 + n] += object_position[:, : qpos.shape[1] - 7 - n]
    return qpos, qvel


def push(root_quaternion: np.ndarray, config: PushConfig, rng: np.random.Generator) -> np.ndarray:
    """Draws pushes.

    Args:
        root_quaternion: (K, 4).
        config: How hard.
        rng: Source of chance.

    Returns:
        (K, 6) to add to the velocity of the root's free joint: linear in the world, angular in the
        body frame, drawn about the world's axes.
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
