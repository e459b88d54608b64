"""Joint targets under which a motion nearly tracks itself: reference, damping and load made up for.

A position-controlled joint gives τ = kp (target - q) - kd q̇. To pass through the reference with the
torque that the motion needs, its target has to be q_ref + (kd / kp) q̇_ref + τ_ref / kp. The torques
come from inverse dynamics of robot and object together, M q̈ + h = S τ + Jᵀ f, where the contact
forces f are those that explain the rows without motors: pyramids at the points where the robot is
close to ground, terrain or object, chosen by non-negative least squares

    min ‖W (M q̈ + h - Jᵀ f)_u‖² + ε_τ ‖(M q̈ + h - Jᵀ f)_a / effort‖² + ε_f ‖(1 + (d / d₀)²) f‖²

with the rows u of free joints and a of hinges, and d the distance of a contact point.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import nnls

from omni_envs.references import Reference
from omni_envs.robots import Robot
from omni_envs.scenes import OBJECT, PhysicsOptions, build_spec
from omni_envs.tracking import quaternion

REACH, NEAR = 0.02, 0.005
"""A contact point further away carries nothing; at the nearer distance a force costs double, m."""

FRICTION_SHARE = 0.6
"""Share of the friction that contact forces may use, so that a box is squeezed with a reserve."""

SMOOTHING = 0.04
"""Deviation of the Gaussian that smooths velocities before they are differentiated, s."""

# Squared, the weights of torques against forces (1 N m of imbalance counts as 3 N), of the object,
# which is lighter than the robot, and of the two regularisers.
_FORCE, _TORQUE, _OBJECT = 1.0, 3.0, 3.0
_EFFORT, _CONTACT = 0.5, 1e-3


def feedforward_lead(robot: Robot, reference: Reference) -> np.ndarray:
    """Returns (T, n) what a joint's target has to be ahead of the reference, rad."""
    kp = np.array([a.stiffness for a in robot.actuators])
    kd = np.array([a.damping for a in robot.actuators])
    torques = inverse_dynamics(robot, reference)[0]
    return (kd * reference.joint_velocities + torques) / kp


def inverse_dynamics(robot: Robot, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
    """Finds the torques that a motion needs.

    Args:
        robot: The robot.
        reference: Its motion, with the scene that carries it.

    Returns:
        (T, n) joint torques, N m, within the effort limits, and (T, 6) the force (N) and torque
        (N m) at the root that no contact explains: where it is large the motion is not one of
        physics.
    """
    model = _model(robot, reference)
    data = mujoco.MjData(model)
    qpos, qvel = reference_state(reference)
    smooth = gaussian_filter1d(qvel, SMOOTHING * reference.fps, axis=0, mode="nearest")
    qacc = np.gradient(smooth, 1.0 / reference.fps, axis=0)
    n = robot.num_joints
    motors = np.arange(6, 6 + n)
    free = np.setdiff1d(np.arange(model.nv), motors)
    weight = np.repeat([_FORCE, _TORQUE, _OBJECT * _FORCE, _OBJECT * _TORQUE], 3)[: len(free)]
    effort = np.array([a.effort for a in robot.actuators])
    torques, missing = np.empty((len(qpos), n)), np.empty((len(qpos), 6))
    for t in range(len(qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[t], qvel[t], qacc[t]
        model.opt.disableflags = 0
        mujoco.mj_fwdPosition(model, data)
        edges, distance = _contact_edges(model, data)
        # Without constraints: contacts are what is looked for.
        model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        mujoco.mj_inverse(model, data)
        needed = data.qfrc_inverse.copy()
        if len(edges):
            rows = [
                (edges[:, free] * weight).T,
                (edges[:, motors] * (_EFFORT / effort)).T,
                np.diag(_CONTACT * (1.0 + (np.maximum(distance, 0.0) / NEAR) ** 2)),
            ]
            sides = [
                needed[free] * weight,
                needed[motors] * (_EFFORT / effort),
                np.zeros(len(edges)),
            ]
            force, _ = nnls(np.concatenate(rows), np.concatenate(sides), maxiter=50 * len(edges))
            needed -= edges.T @ force
        torques[t], missing[t] = np.clip(needed[motors], -effort, effort), needed[:6]
    return torques, missing


def reference_state(reference: Reference) -> tuple[np.ndarray, np.ndarray]:
    """Returns (T, nq) and (T, nv): robot and object as states of the simulation."""
    poses, velocities = reference.object_poses, reference.object_velocities
    if poses is None or velocities is None:
        return reference.qpos, reference.qvel
    spin = quaternion.rotate_inverse(poses[:, 3:], velocities[:, 3:])
    qpos = np.concatenate([reference.qpos, poses], axis=1)
    return qpos, np.concatenate([reference.qvel, velocities[:, :3], spin], axis=1)


def _model(robot: Robot, reference: Reference) -> mujoco.MjModel:
    spec = build_spec(robot, reference.scene, PhysicsOptions(), looks=False)
    for geom in spec.geoms:
        # MuJoCo adds the margins of a pair.
        geom.margin = REACH if geom.parent.name in ("world", OBJECT) else 0.0
        geom.gap = 0.0
    return spec.compile()


def _contact_edges(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Returns the friction pyramids of all contacts with the surroundings.

    Returns:
        (K, nv) generalized forces of a unit force along each edge, and the (K,) distances of their
        contact points, m.
    """
    edges: list[np.ndarray] = []
    distances: list[float] = []
    surroundings = [i == 0 or model.body(i).name == OBJECT for i in range(model.nbody)]
    jacobians = np.empty((2, 3, model.nv))
    for contact in data.contact[: data.ncon]:
        bodies = model.geom_bodyid[contact.geom]
        if contact.dist > REACH or not any(surroundings[b] for b in bodies):
            continue
        for jacobian, body in zip(jacobians, bodies, strict=True):
            mujoco.mj_jac(model, data, jacobian, None, contact.pos, int(body))
        # The contact frame's rows are the normal, from the first to the second, and two tangents.
        normal, *tangents = contact.frame.reshape(3, 3) @ (jacobians[1] - jacobians[0])
        slope = FRICTION_SHARE * contact.friction[0]
        length = np.sqrt(1.0 + slope**2)
        for tangent in tangents:
            edges += [(normal + slope * tangent) / length, (normal - slope * tangent) / length]
            distances += [contact.dist] * 2
    return np.reshape(edges, (-1, model.nv)), np.array(distances)


def action_targets(robot: Robot, references: Sequence[Reference], mode: str) -> list[np.ndarray]:
    """Returns what residual actions count from, (T, n) joint positions per motion, rad.

    Args:
        robot: The robot.
        references: Its motions.
        mode: ``"residual"``: the reference's joint positions; ``"feedforward"``: ahead of them.
    """
    if mode == "residual":
        return [r.joint_positions for r in references]
    return [r.joint_positions + feedforward_lead(robot, r) for r in references]
