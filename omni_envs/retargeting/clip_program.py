"""A clip about a motion as one quadratic program: energy, smoothness and all constraints."""

from __future__ import annotations

import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.clip_qp import Band, ClipQP
from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.interaction_mesh_task import InteractionMeshTask
from omni_envs.retargeting.kept_stance import (
    TIP,
    KeptStance,
    foot_points,
    stance_windows,
)
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, SELF, STANCE, Rows
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.proximal_task import ProximalTask
from omni_envs.retargeting.qp import step_objective, step_rows
from omni_envs.retargeting.stance_plan import stance_tiers
from omni_envs.robots import Robot

# Multipliers of these problems are of the order of 1: constraints that can be met are met to 10 µm.
_STIFFNESS = np.empty(3)
_STIFFNESS[[STANCE, SELF, CONTACT]] = 1e6, 1e7, 1e7
_RIDGE = 1e-6
# Part of a speed limit that is left to the restoration of the true constraints.
_RESERVE = 0.03


def motion_steps(qpos: np.ndarray) -> np.ndarray:
    """(T - 1, nv) tangents q_{t+1} ⊖ q_t of (T, 7 + n) configurations."""
    linear, joints = np.diff(qpos[:, :3], axis=0), np.diff(qpos[:, 7:], axis=0)
    return np.hstack([linear, rotations.difference(qpos[:-1, 3:7], qpos[1:, 3:7]), joints])


def moved(qpos: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(T, 7 + n) configurations q_t ⊕ x_t."""
    turned = rotations.multiply(qpos[:, 3:7], rotations.exp(x[:, 3:6]))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return np.hstack([qpos[:, :3] + x[:, :3], turned, qpos[:, 7:] + x[:, 6:]])


class ClipProgram:
    """The smoothness problem of one clip.

    minimise Σ_t ½ w E_t + ½ w_v ‖v_t‖²_S + ½ w_a ‖v_{t+1} - v_t‖²_S + posture, v_t = q_{t+1} ⊖ q_t,
    subject to the constraints of ``retarget``, stance relative to the motion that is refined.

    Args:
        source: What the motion follows.
        robot: The robot.
        options: Settings of the retargeter.
        acceleration_weight: Weight of ‖acceleration‖²_S on every frame, SI units.
        qpos: (T, nq) the motion to refine.
    """

    def __init__(
        self,
        source: SourceMotion,
        robot: Robot,
        options: RetargetOptions,
        acceleration_weight: float,
        qpos: np.ndarray,
    ) -> None:
        self.source, self.robot = source, robot
        self.configuration = Kinematics(
            robot,
            source.scene,
            options.contact_distance,
            options.self_distance if options.self_collision else None,
        )
        mesh = InteractionMesh.of(source, options.surface_points)
        self.mesh = InteractionMeshTask(mesh, options.laplacian_weight)
        posture = np.zeros(robot.nv)
        for joint, weight in robot.posture_weights.items():
            posture[6 + robot.joint_names.index(joint)] = weight
        self._posture = ProximalTask(posture)
        self._posture.set_target(
            np.concatenate([[0, 0, 0, 1, 0, 0, 0], np.zeros(robot.num_joints)])
        )
        metric = self.configuration.metric
        self._velocity_weight = options.smoothness_weight * metric
        self._acceleration_weight = acceleration_weight * source.fps**4 * metric
        self._step = np.full(robot.num_joints, np.inf)
        if options.velocity_limits is not None:
            self._step = robot.velocity_limits * (options.velocity_limits / source.fps)
        self.contact = ContactLimit(options.penetration_tolerance)
        self._points = foot_points(robot, self.configuration)
        tiers = stance_tiers(source, options.stance)
        self.windows = stance_windows(self._feet(qpos), tiers, source.fps, options.stance)
        self.stance = KeptStance(self.windows, self._points)

    def place(self, t: int) -> None:
        """Sets mesh and object to frame t."""
        self.mesh.set_frame(t)
        if self.source.object_poses is not None:
            self.configuration.place_object(self.source.object_poses[t])

    def linearise(self, qpos: np.ndarray, start: int, stop: int, radius: float) -> ClipQP:
        """The program of the frames [start, stop) for a step of at most ``radius`` per coordinate.

        The frames around them stay where they are.

        Args:
            qpos: (T, nq) the motion to linearise about.
            start: First frame.
            stop: End of the frames.
            radius: Half width of the box about the motion.
        """
        frames, n = stop - start, self.robot.nv
        H, g = np.empty((frames, n, n)), np.empty((frames, n))
        tips, tip_jacobians = np.empty((frames, 2, 2)), np.empty((frames, 2, 2, n))
        rows: list[Rows] = []
        configuration = self.configuration
        for i, t in enumerate(range(start, stop)):
            self.place(t)
            configuration.update(qpos[t])
            H[i], g[i] = step_objective(configuration, [self.mesh, self._posture])
            self.stance.set_frame(t, None)
            rows.append(step_rows(configuration, [self.contact, self.stance]))
            places = configuration.positions(self._points)
            jacobian = configuration.jacobians(self._points, places)[:2]
            tips[i] = places.reshape(2, 2, 3)[:, TIP, :2]
            tip_jacobians[i] = np.moveaxis(jacobian, 0, 1).reshape(2, 2, 2, n)[:, TIP]
        D, E = self._add_smoothness(H, g, qpos, start, stop)
        A, band = _padded(rows, n)
        B, C, pairs = self._slow_tips(start, tips, tip_jacobians)
        box = self._box(qpos[start:stop, 7:], radius)
        change = self._change(qpos[start:stop, 7:], radius)
        return ClipQP(H, g, D, E, box, change, band, A, pairs, B, C)

    def _feet(self, qpos: np.ndarray) -> np.ndarray:
        """(T, 2, 2, 2) horizontal places of tip and heart of both feet."""
        feet = np.empty((len(qpos), 2, 2, 2))
        for t, q in enumerate(qpos):
            self.configuration.update(q)
            feet[t] = self.configuration.positions(self._points).reshape(2, 2, 3)[..., :2]
        return feet

    def _add_smoothness(
        self, H: np.ndarray, g: np.ndarray, qpos: np.ndarray, start: int, stop: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Adds velocity and acceleration to H and g; returns their off-diagonals D and E.

        To first order v_t changes by x_{t+1} - x_t, as the root turns little between frames.
        """
        count, n = len(qpos), g.shape[1]
        steps = motion_steps(qpos)
        diagonal, gradient = np.full((count, n), _RIDGE), np.zeros((count, n))
        first, second = np.zeros((max(count - 1, 0), n)), np.zeros((max(count - 2, 0), n))
        weight = self._velocity_weight
        diagonal[1:] += weight
        diagonal[:-1] += weight
        gradient[1:] += weight * steps
        gradient[:-1] -= weight * steps
        first -= weight
        if count > 2:
            weight = self._acceleration_weight
            change = weight * np.diff(steps, axis=0)
            for shift, sign in ((0, 1.0), (1, -2.0), (2, 1.0)):
                diagonal[shift : count - 2 + shift] += sign * sign * weight
                gradient[shift : count - 2 + shift] += sign * change
            first[1:] -= 2.0 * weight
            first[:-1] -= 2.0 * weight
            second += weight
        part = slice(start, stop)
        H.reshape(len(H), -1)[:, :: n + 1] += diagonal[part]
        g += gradient[part]
        return first[start : stop - 1], second[start : max(stop - 2, start)]

    def _box(self, joints: np.ndarray, radius: float) -> Band:
        """The box about the motion, cut by the joint limits."""
        lower, upper = np.full((2, len(joints), self.robot.nv), radius)
        lower *= -1.0
        low, high = self.robot.reference_joint_ranges.T
        # An interior point needs an interior; rounding is undone by the restoration.
        lower[:, 6:] = np.clip(low - joints, -radius, -1e-7)
        upper[:, 6:] = np.clip(high - joints, 1e-7, radius)
        return Band(lower, upper)

    def _change(self, joints: np.ndarray, radius: float) -> Band:
        """Speed limits, where the box lets the motion reach them."""
        lower = np.full((len(joints) - 1, self.robot.nv), -np.inf)
        upper, steps = -lower, np.diff(joints, axis=0)
        limit = self._step * (1.0 - _RESERVE)
        near = np.abs(steps) + 2.0 * radius > limit
        lower[:, 6:] = np.where(near, np.minimum(-limit - steps, -1e-7), -np.inf)
        upper[:, 6:] = np.where(near, np.maximum(limit - steps, 1e-7), np.inf)
        return Band(lower, upper)

    def _slow_tips(
        self, start: int, tips: np.ndarray, jacobians: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, Band]:
        """Speed limits of planted tips that are not anchored, between successive frames."""
        frames, n = len(tips), jacobians.shape[-1]
        slow = np.repeat(self.windows.slow[start + 1 : start + frames], 2, axis=1)
        if not slow.any():
            empty = np.zeros((frames - 1, 0))
            return np.zeros((frames - 1, 0, n)), np.zeros((frames - 1, 0, n)), Band(empty, empty)
        steps = np.diff(tips, axis=0).reshape(frames - 1, 4)
        limit = self.windows.step * (1.0 - _RESERVE)
        lower = np.where(slow, -limit - steps, -np.inf)
        upper = np.where(slow, limit - steps, np.inf)
        flat = jacobians.reshape(frames, 4, n)
        return -flat[:-1], flat[1:], Band(lower, upper, _STIFFNESS[STANCE])


def _padded(rows: list[Rows], n: int) -> tuple[np.ndarray, Band]:
    """Rows of all frames as arrays of equal length."""
    counts = np.array([len(r.lower) for r in rows])
    shape = (len(rows), int(counts.max(initial=0)))
    A, stiffness = np.zeros((*shape, n)), np.ones(shape)
    lower, upper = np.full(shape, -np.inf), np.full(shape, np.inf)
    used = np.arange(shape[1]) < counts[:, None]
    A[used] = np.concatenate([r.A for r in rows])
    lower[used] = np.concatenate([r.lower for r in rows])
    upper[used] = np.concatenate([r.upper for r in rows])
    stiffness[used] = _STIFFNESS[np.concatenate([r.kind for r in rows])]
    return A, Band(lower, upper, stiffness)
