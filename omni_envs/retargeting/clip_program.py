"""A clip about a motion as one quadratic program: energy, smoothness and all constraints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.clip_kinematics import ClipKinematics, trace_clip
from omni_envs.retargeting.clip_qp import Band, ClipQP
from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.contact_task import ContactTask
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.kept_stance import (
    TIP,
    KeptStance,
    foot_points,
    stance_windows,
)
from omni_envs.retargeting.kinematics import Kinematics, Points
from omni_envs.retargeting.limits import CONTACT, SELF, STANCE, Rows
from omni_envs.retargeting.nominal_task import nominal_weights
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.orientation_task import OrientationTask
from omni_envs.retargeting.qp import step_rows
from omni_envs.retargeting.sole_task import SoleTask
from omni_envs.retargeting.stance_plan import ANCHORED, stance_tiers
from omni_envs.retargeting.tangents import difference, motion_steps
from omni_envs.retargeting.tasks import Quadratic
from omni_envs.robots import KEYPOINTS, Robot

# Multipliers of these problems are mostly below 10: constraints that can be met are met to 10 µm.
_STIFFNESS = np.empty(3)
_STIFFNESS[[STANCE, SELF, CONTACT]] = 1e6, 1e7, 1e7
_RIDGE = 1e-6
# Part of a speed limit that is left to the restoration of the true constraints.
_RESERVE = 0.005
_K = len(KEYPOINTS)
_FEET = 10  # rows of a frame that hold feet


class ClipProgram:
    """The smoothness problem of one clip.

    minimise Σ_t ½ w E_t + ½ w_v ‖v_t‖²_S + ½ w_a ‖v_{t+1} - v_t‖²_S + contact + posture + nominal,
    v_t = q_{t+1} ⊖ q_t, subject to the constraints of ``retarget``, with stance relative to the
    motion that is refined.

    Args:
        source: What the motion follows.
        robot: The robot.
        options: Settings of the retargeter.
        acceleration_weight: Weight of ‖acceleration‖²_S on every frame, SI units.
        qpos: (T, nq) the motion to refine.
        nominal: (T, nq) the motion that it was anchored to, or None.
    """

    def __init__(
        self,
        source: SourceMotion,
        robot: Robot,
        options: RetargetOptions,
        acceleration_weight: float,
        qpos: np.ndarray,
        nominal: np.ndarray | None = None,
    ) -> None:
        self.source, self.robot = source, robot
        self.configuration = Kinematics(
            robot,
            source.scene,
            options.contact_distance,
            options.self_distance if options.self_collision else None,
        )
        self.mesh = InteractionMesh.of(source, options.surface_points, options.ground_points)
        self._mesh_weight = options.laplacian_weight
        self._posture_weight = np.zeros(robot.nv)
        for joint, weight in robot.posture_weights.items():
            self._posture_weight[6 + robot.joint_names.index(joint)] = weight
        self._touching = options.contact_weight > 0
        self._touch = ContactTask(source, self.configuration, options.contact_weight)
        self._orientation: OrientationTask | None = None
        if options.orientation_weights:
            self._orientation = OrientationTask(
                source.keypoints, self.configuration, options.orientation_weights
            )
        metric = self.configuration.metric
        self._velocity_weight = options.smoothness_weight * metric
        self._nominal, self._nominal_weight = nominal, np.zeros((len(qpos), robot.nv))
        if nominal is not None:
            self._nominal_weight = nominal_weights(
                self.configuration, options, len(qpos), source.fps
            )
        self._acceleration_weight = acceleration_weight * source.fps**4 * metric
        self._step = np.full(robot.num_joints, np.inf)
        if options.velocity_limits is not None:
            self._step = robot.velocity_limits * (options.velocity_limits / source.fps)
        self.contact = ContactLimit(options.penetration_tolerance)
        keypoints, (bodies, offsets) = [robot.keypoints[k] for k in KEYPOINTS], foot_points(robot)
        self._points = Points(
            self.configuration.model,
            [*(k.body for k in keypoints), *bodies],
            np.concatenate([[k.offset for k in keypoints], offsets]),
        )
        feet = self._trace(qpos, 0, len(qpos)).positions[:, _K:].reshape(-1, 2, 2, 3)
        tiers = stance_tiers(source, options.stance)
        human = HumanFeet.of(source, tiers == ANCHORED)
        self._soles = SoleTask(human, source.fps, options.sole_weight)
        self.windows = stance_windows(feet, tiers, human, source.fps, options.stance)
        self.stance = KeptStance(self.windows, self.configuration)

    def place(self, t: int) -> None:
        """Puts the object where it is on frame t."""
        if self.source.object_poses is not None:
            self.configuration.place_object(self.source.object_poses[t])

    def depths(self, qpos: np.ndarray, start: int, stop: int) -> np.ndarray:
        """(F,) how far the frames [start, stop) of a motion penetrate anything, m."""
        depths = np.zeros(stop - start)
        for i, t in enumerate(range(start, stop)):
            self.place(t)
            self.configuration.update(qpos[t])
            rows = self.contact.rows(self.configuration)
            if rows is not None:
                depths[i] = rows.lower.max(initial=0.0)
        return depths

    def linearise(
        self, qpos: np.ndarray, start: int, stop: int, radius: float | np.ndarray
    ) -> ClipQP:
        """The program of the frames [start, stop) for a step of at most ``radius`` per coordinate.

        The frames around them stay where they are.

        Args:
            qpos: (T, nq) the motion to linearise about.
            start: First frame.
            stop: End of the frames.
            radius: Half width of the box about the motion, of all or of each of the frames.
        """
        radius = np.broadcast_to(radius, stop - start)
        contacts: list[Rows] = []
        costs: list[tuple[int, Quadratic | None]] = []

        def visit(t: int) -> None:
            contacts.append(step_rows(self.configuration, [self.contact]))
            self._touch.set_frame(t if self._touching else None)
            costs.append((t - start, self._touch.quadratic(self.configuration)))
            self._soles.set_frame(t)
            costs.append((t - start, self._soles.quadratic(self.configuration)))
            if self._orientation is not None:
                self._orientation.set_frame(t)
                costs.append((t - start, self._orientation.quadratic(self.configuration)))

        trace = self._trace(qpos, start, stop, visit)
        H, g = self._objective(trace, start)
        for i, model in costs:
            if model is not None:
                H[i] += model.H
                g[i] += model.g
        D, E = self._add_smoothness(H, g, qpos, start)
        frames, n = g.shape
        feet = trace.positions[:, _K:].reshape(frames, 2, 2, 3)
        jacobians = trace.jacobians[:, :, _K:].transpose(0, 2, 1, 3).reshape(frames, 2, 2, 3, n)
        A, rows = self._rows(contacts, feet, jacobians, start)
        B, C, pairs = self._tip_steps(feet[:, :, TIP], jacobians[:, :, TIP], start)
        box = self._box(qpos[start:stop, 7:], radius)
        change = self._change(qpos[start:stop, 7:], radius)
        return ClipQP(H, g, D, E, box, change, rows, A, pairs, B, C)

    def _trace(
        self, qpos: np.ndarray, start: int, stop: int, visit: Callable[[int], None] | None = None
    ) -> ClipKinematics:
        """Keypoints and feet of the frames; ``visit`` is called at each."""
        return trace_clip(self.configuration, self._points, qpos, start, stop, self.place, visit)

    def _objective(self, trace: ClipKinematics, start: int) -> tuple[np.ndarray, np.ndarray]:
        """Gauss-Newton blocks of the deformation energy."""
        count, n = len(trace.positions), self.robot.nv
        factor, offset = (
            part[start : start + count] for part in (self.mesh.factor, self.mesh.offset)
        )
        residual = (factor @ trace.positions[:, :_K] + offset).transpose(0, 2, 1)
        jacobian = (factor[:, None] @ trace.jacobians[:, :, :_K]).reshape(count, -1, n)
        H = self._mesh_weight * (jacobian.transpose(0, 2, 1) @ jacobian)
        g = self._mesh_weight * (residual.reshape(count, 1, -1) @ jacobian)[:, 0]
        return H, g

    def _add_smoothness(
        self, H: np.ndarray, g: np.ndarray, qpos: np.ndarray, start: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Adds velocity, acceleration, posture and nominal motion; returns D and E.

        To first order v_t changes by x_{t+1} - x_t, as the root turns little between frames.
        """
        count, (frames, n) = len(qpos), g.shape
        steps = motion_steps(qpos)
        diagonal = np.tile(self._posture_weight + _RIDGE, (count, 1))
        gradient = np.zeros((count, n))
        gradient[:, 6:] = self._posture_weight[6:] * qpos[:, 7:]
        if self._nominal is not None:
            diagonal += self._nominal_weight
            gradient -= self._nominal_weight * difference(qpos, self._nominal)
        D, E = np.zeros((max(count - 1, 0), n)), np.zeros((max(count - 2, 0), n))
        weight = self._velocity_weight
        diagonal[1:] += weight
        diagonal[:-1] += weight
        gradient[1:] += weight * steps
        gradient[:-1] -= weight * steps
        D -= weight
        if count > 2:
            weight = self._acceleration_weight
            change = weight * np.diff(steps, axis=0)
            for shift, factor in ((0, 1.0), (1, -2.0), (2, 1.0)):
                diagonal[shift : count - 2 + shift] += factor * factor * weight
                gradient[shift : count - 2 + shift] += factor * change
            D[1:] -= 2.0 * weight
            D[:-1] -= 2.0 * weight
            E += weight
        stop = start + frames
        H.reshape(frames, -1)[:, :: n + 1] += diagonal[start:stop]
        g += gradient[start:stop]
        return D[start : stop - 1], E[start : max(stop - 2, start)]

    def _box(self, joints: np.ndarray, radius: np.ndarray) -> Band:
        """The box about the motion, cut by the joint limits."""
        radius = radius[:, None]
        upper = np.repeat(radius, self.robot.nv, axis=1)
        lower = -upper
        low, high = self.robot.reference_joint_ranges.T
        # An interior point needs an interior; rounding is undone by the restoration.
        lower[:, 6:] = np.clip(low - joints, -radius, -1e-7)
        upper[:, 6:] = np.clip(high - joints, 1e-7, radius)
        return Band(lower, upper)

    def _change(self, joints: np.ndarray, radius: np.ndarray) -> Band:
        """Speed limits, where the box lets the motion reach them."""
        lower = np.full((len(joints) - 1, self.robot.nv), -np.inf)
        upper, steps = -lower, np.diff(joints, axis=0)
        limit = self._step * (1.0 - _RESERVE)
        near = np.abs(steps) + (radius[1:] + radius[:-1])[:, None] > limit
        lower[:, 6:] = np.where(near, np.minimum(-limit - steps, -1e-7), -np.inf)
        upper[:, 6:] = np.where(near, np.maximum(limit - steps, 1e-7), np.inf)
        return Band(lower, upper)

    def _rows(
        self, contacts: list[Rows], feet: np.ndarray, jacobians: np.ndarray, start: int
    ) -> tuple[np.ndarray, Band]:
        """Rows of all frames as arrays of equal length: ten windows of feet, then contacts."""
        frames, n = len(feet), jacobians.shape[-1]
        counts = np.array([len(r.lower) for r in contacts])
        shape = (frames, _FEET + int(counts.max(initial=0)))
        A, stiffness = np.zeros((*shape, n)), np.full(shape, _STIFFNESS[STANCE])
        lower, upper = np.full(shape, -np.inf), np.full(shape, np.inf)
        part = slice(start, start + frames)
        axes, slack = self.windows.axes[part, :, None], self.windows.slack[part]
        offset = (axes @ feet[..., None])[..., 0] - self.windows.centre[part]
        A[:, :8] = (axes @ jacobians).reshape(frames, 8, n)
        lower[:, :8] = (-slack - offset).reshape(frames, 8)
        upper[:, :8] = (slack - offset).reshape(frames, 8)
        A[:, 8:_FEET] = jacobians[:, :, TIP, 2]
        upper[:, 8:_FEET] = self.windows.ceiling[part] - feet[:, :, TIP, 2]
        used = np.zeros(shape, bool)
        used[:, _FEET:] = np.arange(shape[1] - _FEET) < counts[:, None]
        A[used] = np.concatenate([r.A for r in contacts])
        lower[used] = np.concatenate([r.lower for r in contacts])
        upper[used] = np.concatenate([r.upper for r in contacts])
        stiffness[used] = _STIFFNESS[np.concatenate([r.kind for r in contacts])]
        return A, Band(lower, upper, stiffness)

    def _tip_steps(
        self, tips: np.ndarray, jacobians: np.ndarray, start: int
    ) -> tuple[np.ndarray, np.ndarray, Band]:
        """Limits on the steps of planted tips between successive frames."""
        frames, n = len(tips), jacobians.shape[-1]
        limit = self.windows.steps[start + 1 : start + frames].reshape(frames - 1, 6)
        if not np.isfinite(limit).any():
            empty = np.zeros((frames - 1, 0))
            return np.zeros((frames - 1, 0, n)), np.zeros((frames - 1, 0, n)), Band(empty, empty)
        steps = np.diff(tips, axis=0).reshape(frames - 1, 6)
        limit = limit * (1.0 - _RESERVE)
        flat = jacobians.reshape(frames, 6, n)
        return -flat[:-1], flat[1:], Band(-limit - steps, limit - steps, _STIFFNESS[STANCE])
