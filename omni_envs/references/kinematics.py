"""From joint positions to everything a reference holds: velocities and the pose of every body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import InvalidDataError
from omni_envs.metrics.report import ReferenceReport
from omni_envs.references.reference import Reference
from omni_envs.robots import Robot
from omni_envs.scenes import Scene


def reference_from_qpos(
    robot: Robot,
    fps: float,
    qpos: np.ndarray,
    object_poses: np.ndarray | None = None,
    scene: Scene | None = None,
    contacts: Mapping[str, np.ndarray] | None = None,
    stance: np.ndarray | None = None,
    *,
    report: ReferenceReport | None = None,
    source: SourceMotion | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> Reference:
    """Completes a motion to a reference: forward kinematics and velocities of every frame.

    Args:
        robot: The robot.
        fps: Frames per second.
        qpos: (T, 7 + n) configurations.
        object_poses: (T, 7) object poses where the scene has an object.
        scene: Surroundings, flat ground by default.
        contacts: Link to (T,) bool.
        stance: (T, 2) bool, none planted by default.
        report: Metrics of the motion.
        source: The demonstration that the motion follows, at the same frames.
        provenance: JSON-compatible facts about the origin.

    Raises:
        InvalidDataError: Arrays do not fit each other or the robot.
    """
    qpos = np.array(qpos, float)
    if qpos.ndim != 2 or qpos.shape[1] != robot.nq or not len(qpos):
        raise InvalidDataError(
            "Motion", "qpos", f"(T, {robot.nq}) for {robot.title}", str(qpos.shape)
        )
    if not np.isfinite(qpos).all():
        raise InvalidDataError("Motion", "qpos", "finite", "NaN or infinity")
    if not (np.isfinite(fps) and fps > 0):
        raise InvalidDataError("Motion", "fps", "positive", str(fps))
    poses = None if object_poses is None else np.array(object_poses, float)
    if poses is not None and poses.shape != (len(qpos), 7):
        raise InvalidDataError("Motion", "object_poses", f"({len(qpos)}, 7)", str(poses.shape))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    if poses is not None:
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    qvel = generalized_velocities(qpos, fps)
    positions, quaternions, linear, angular = body_kinematics(robot.model, qpos, qvel)
    return Reference(
        robot=robot.name,
        fps=float(fps),
        qpos=qpos,
        qvel=qvel,
        body_names=robot.body_names,
        body_positions=positions,
        body_quaternions=quaternions,
        body_linear_velocities=linear,
        body_angular_velocities=angular,
        stance=np.zeros((len(qpos), 2), bool) if stance is None else np.asarray(stance),
        scene=scene or Scene(),
        object_poses=poses,
        object_velocities=None if poses is None else pose_velocities(poses, fps),
        contacts=dict(contacts or {}),
        report=report,
        source=source,
        provenance=dict(provenance or {}),
    )


def generalized_velocities(qpos: np.ndarray, fps: float) -> np.ndarray:
    """Differentiates configurations on their manifold.

    The velocity of a frame is the mean of the tangent vectors from the previous frame and to the
    next one, both in the tangent space of the frame itself; the first and the last frame have only
    one of the two.

    Args:
        qpos: (T, 7 + n), free joint first.
        fps: Frames per second.

    Returns:
        (T, 6 + n) MuJoCo velocities: the free joint's linear part in the world, its angular part in
        the body frame. One frame has no velocity: zeros.
    """
    steps = np.concatenate(
        [
            np.diff(qpos[:, :3], axis=0),
            rotations.difference(qpos[:-1, 3:7], qpos[1:, 3:7]),
            np.diff(qpos[:, 7:], axis=0),
        ],
        axis=1,
    )
    velocities = np.zeros((len(qpos), qpos.shape[1] - 1))
    if len(steps):
        velocities[0], velocities[-1] = steps[0], steps[-1]
        velocities[1:-1] = 0.5 * (steps[:-1] + steps[1:])
    return velocities * fps


def pose_velocities(poses: np.ndarray, fps: float) -> np.ndarray:
    """Returns the (T, 6) linear and angular velocities of (T, 7) poses, both in the world."""
    velocities = generalized_velocities(poses, fps)
    velocities[:, 3:] = rotations.rotate(poses[:, 3:], velocities[:, 3:])
    return velocities


def body_kinematics(
    model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Poses and velocities of all bodies, as the simulator has them at (qpos, qvel).

    MuJoCo's ``cvel`` is the velocity of the point of the body at the centre of mass of its
    kinematic tree. At the body's own origin x the velocity is v = cvel_v + cvel_ω × (x - com).

    Args:
        model: The robot alone.
        qpos: (T, nq).
        qvel: (T, nv).

    Returns:
        Positions (T, B, 3), quaternions wxyz (T, B, 4), linear velocities (T, B, 3) of the origins
        and angular velocities (T, B, 3), all in the world, of all bodies but the world.
    """
    data = mujoco.MjData(model)
    frames, bodies = len(qpos), model.nbody
    positions, com = np.empty((frames, bodies, 3)), np.empty((frames, bodies, 3))
    quaternions, twist = np.empty((frames, bodies, 4)), np.empty((frames, bodies, 6))
    for t in range(frames):
        data.qpos[:], data.qvel[:] = qpos[t], qvel[t]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        positions[t], quaternions[t] = data.xpos, data.xquat
        twist[t], com[t] = data.cvel, data.subtree_com[model.body_rootid]
    angular = twist[..., :3]
    linear = twist[..., 3:] + np.cross(angular, positions - com)
    return positions[:, 1:], quaternions[:, 1:], linear[:, 1:], angular[:, 1:].copy()
