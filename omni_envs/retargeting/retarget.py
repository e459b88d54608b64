"""Retargeting: a human motion becomes a robot motion, frame by frame.

On every frame t (OmniRetarget, arXiv 2509.26633, eq. 3-4):

    minimise   w ‖L(p(q)) - δ_t‖²                 ``interaction_mesh``, ``interaction_mesh_task``
               + ‖q ⊖ q_{t-1}‖²_Q  + posture      ``proximal_task``
               + ‖q ⊖ q_nominal‖²_N              ``nominal_task``, where there is one
               + orientations of links           ``orientation_task``, where asked for
    subject to φ_j(q) ≥ 0                         ``contact_limit``: surroundings and self
               q_min ≤ q ≤ q_max                  ``joint_limits``
               |q - q_{t-1}| ≤ v_max Δt           ``joint_limits``
               p_foot(q) = p_foot(stance start)   ``stance_limit``
               ‖dq‖ ≤ ε on each step              ``solver``

Before, ``sketch`` finds where the feet shall stand; frames that are caught start from it again.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import InvalidDataError
from omni_envs.progress import ProgressCallback
from omni_envs.retargeting.clarabel_solver import solve_clarabel
from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.contact_task import ContactTask
from omni_envs.retargeting.first_frame import aligned_poses
from omni_envs.retargeting.foothold_task import FootholdTask
from omni_envs.retargeting.frame_solver import FrameResult, FrameSolver
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.interaction_mesh import InteractionMesh
from omni_envs.retargeting.interaction_mesh_task import InteractionMeshTask
from omni_envs.retargeting.joint_limits import JointLimit, StepVelocityLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import RowLimit
from omni_envs.retargeting.nominal_task import NominalTask, check_nominal, nominal_weights
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.orientation_task import OrientationTask
from omni_envs.retargeting.proximal_task import ProximalTask
from omni_envs.retargeting.restoration import KINDS
from omni_envs.retargeting.result import (
    RELAXATIONS,
    Retargeted,
    SolveRecord,
    relaxation_tolerance,
)
from omni_envs.retargeting.sketch import Sketch, sketched_frames
from omni_envs.retargeting.softness import softness
from omni_envs.retargeting.sole_task import SoleTask
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.retargeting.stance_limit import StanceLimit
from omni_envs.retargeting.stance_plan import (
    ANCHORED,
    StancePlan,
    foot_wishes,
    plan_stance,
    stance_tiers,
)
from omni_envs.retargeting.tasks import CostTask
from omni_envs.robots import Robot

_AHEAD = 0.9
_BETTER = 0.98  # of the cost: what a second start must come below
_INSIDE = 1e-3  # m: a robot left deeper in itself or the surroundings starts a second time, too
# Cost of violations of stance, self-collision and non-penetration, 1/m.
_FORBIDDEN = 100.0 * softness(np.array(KINDS))[1]
_COARSE = 10.0  # times the convergence: for a sketch
_FIRST = 1e-5  # convergence on the first frame: whatever is left there drifts into the motion


def retarget(
    source: SourceMotion,
    robot: Robot,
    options: RetargetOptions | None = None,
    progress: ProgressCallback | None = None,
    nominal: Retargeted | np.ndarray | None = None,
) -> Retargeted:
    """Retargets a source motion to a robot.

    Never fails on a motion that contradicts the constraints: they give way in the order of
    ``RELAXATIONS``, and ``Retargeted.frames`` says where and by how much.

    Args:
        source: Motion at the robot's scale.
        robot: The robot.
        options: Settings.
        progress: Called with (frames done, frames in all).
        nominal: For an augmented source, the motion of the unchanged one, or its (T, 7 + n)
            configurations: base and legs are anchored to it, and the feet start where it has them
            (section III-B).

    Returns:
        The robot motion at the source's fps.

    Raises:
        InvalidDataError: The source is not finite, has no frames or no frame rate, or the nominal
            motion is not one of this robot with as many frames.
    """
    options = options or RetargetOptions()
    _check(source)
    if nominal is not None:
        given = nominal.qpos if isinstance(nominal, Retargeted) else nominal
        nominal = check_nominal(robot, given, source.num_frames)
    mesh = InteractionMesh.of(source, options.surface_points, options.ground_points)
    return _Retargeter(source, robot, options, mesh, nominal).run(progress)


def deformation_energy(
    source: SourceMotion,
    robot: Robot,
    qpos: np.ndarray,
    options: RetargetOptions | None = None,
) -> np.ndarray:
    """Deformation energy of a robot motion against a source, in the object's frame.

    Args:
        source: The motion it follows, with its object poses.
        robot: The robot.
        qpos: (T, 7 + n) configurations, one per frame of the source.
        options: Settings of the mesh.

    Returns:
        (T,) energy, weight 1, m².

    Raises:
        InvalidDataError: qpos does not have a row per frame of the source.
    """
    expected = (source.num_frames, robot.nq)
    if np.shape(qpos) != expected:
        raise InvalidDataError(
            f"Motion of {robot.name!r}", "qpos", f"of shape {expected}", str(np.shape(qpos))
        )
    options = options or RetargetOptions()
    mesh = InteractionMesh.of(source, options.surface_points, options.ground_points)
    return mesh.energy(keypoint_positions(robot, source, qpos))


def keypoint_positions(robot: Robot, source: SourceMotion, qpos: np.ndarray) -> np.ndarray:
    """(T, 15, 3) world keypoints of (T, 7 + n) configurations."""
    configuration = Kinematics(robot, source.scene)
    keypoints = np.empty((len(qpos), source.keypoints.shape[1], 3))
    for t, q in enumerate(qpos):
        configuration.update(q)
        keypoints[t] = configuration.keypoints()
    return keypoints


def _check(source: SourceMotion) -> None:
    owner = f"SourceMotion {source.name!r}"
    if source.num_frames < 1:
        raise InvalidDataError(owner, "keypoints", "at least one frame", "0 frames")
    if not (np.isfinite(source.fps) and source.fps > 0):
        raise InvalidDataError(owner, "fps", "positive", str(source.fps))
    for name in ("keypoints", "object_poses", "source_object_poses"):
        array = getattr(source, name)
        if array is not None and not np.isfinite(array).all():
            first = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
            raise InvalidDataError(owner, name, "finite", f"NaN or infinity first at {first}")


class _Retargeter:
    """The tasks and limits of one clip, and the loop over its frames."""

    def __init__(
        self,
        source: SourceMotion,
        robot: Robot,
        options: RetargetOptions,
        mesh: InteractionMesh,
        nominal: np.ndarray | None,
    ) -> None:
        self.source, self.robot, self.options = source, robot, options
        self.nominal_motion = nominal
        kinematics: type[Kinematics] = Kinematics
        step_solver = solve_daqp if options.solver == "daqp" else solve_clarabel
        if options.backend == "placo":
            from omni_envs.retargeting.placo_backend import PlacoKinematics, solve_placo

            kinematics, step_solver = PlacoKinematics, solve_placo
        self.configuration = kinematics(
            robot,
            source.scene,
            options.contact_distance,
            options.self_distance if options.self_collision else None,
        )
        metric = self.configuration.metric
        self.mesh = InteractionMeshTask(mesh, options.laplacian_weight)
        self.smoothness = ProximalTask(options.smoothness_weight * metric)
        posture = np.zeros(robot.nv)
        for joint, weight in robot.posture_weights.items():
            posture[6 + robot.joint_names.index(joint)] = weight
        self.touch = ContactTask(source, self.configuration, options.contact_weight)
        self.posture = ProximalTask(posture)
        self.posture.set_target(np.concatenate([[0, 0, 0, 1, 0, 0, 0], np.zeros(robot.num_joints)]))
        bounds = [JointLimit(robot)]
        self.velocity = None
        if options.velocity_limits is not None:
            self.velocity = StepVelocityLimit(robot, source.fps, options.velocity_limits)
            bounds.append(self.velocity)
        tasks: list[CostTask] = [self.mesh, self.smoothness, self.posture]
        if options.contact_weight > 0 and source.contact_points:
            tasks.append(self.touch)
        self.tier = stance_tiers(source, options.stance)
        self.human_feet = HumanFeet.of(source, self.tier == ANCHORED)
        self.soles = SoleTask(self.human_feet, source.fps, options.sole_weight)
        tasks.append(self.soles)
        self.orientation: OrientationTask | None = None
        if options.orientation_weights:
            self.orientation = OrientationTask(
                source.keypoints, self.configuration, options.orientation_weights
            )
            tasks.append(self.orientation)
        self.nominal: NominalTask | None = None
        if nominal is not None:
            weights = nominal_weights(self.configuration, options, source.num_frames, source.fps)
            self.nominal = NominalTask(nominal, weights)
            tasks.append(self.nominal)
        self.limits: list[RowLimit] = [ContactLimit(options.penetration_tolerance)]
        self.solver = FrameSolver(
            self.configuration,
            tasks,
            bounds,
            self.limits,
            step_solver,
            options,
        )
        self.through_walls = FrameSolver(
            self.configuration, list(tasks), bounds, [ContactLimit(np.inf)], step_solver, options
        )

    def run(self, progress: ProgressCallback | None) -> Retargeted:
        frames, options = self.source.num_frames, self.options
        qpos = np.empty((frames, self.robot.nq))
        energy, seconds = np.empty(frames), np.empty(frames)
        iterations = np.empty(frames, int)
        violations = np.empty((frames, len(RELAXATIONS)))
        previous = self._first().q
        sketch = self._sketch(previous)
        plan = self._plan(sketch)
        stance = StanceLimit(plan, self.options.stance)
        self.limits.append(stance)
        foothold = FootholdTask(plan)
        self.solver.tasks.append(foothold)
        for t in range(frames):
            start = perf_counter()
            self._place(t)
            self.smoothness.set_target(previous)
            if t > 0 and self.velocity is not None:
                self.velocity.set_previous(previous)
            foothold.set_frame(t)
            self.touch.set_frame(t)
            stance.hold(t)
            result = self.solver.solve(
                previous if t < 2 else self._ahead(qpos[t - 2], previous),
                options.iterations if t else options.first_iterations,
                options.trust_region,
                options.convergence if t else _FIRST,
                fallback=previous,
            )
            if max(result.violations[1:]) > _INSIDE:
                result = self._freed(previous, result)
            drawn = sketch.drawn(t)
            if t > 0 and drawn is not None and sketch.catches(drawn, self._cost()):
                result = self._freed(sketch.qpos[drawn], result)
            stance.record(self.configuration, t)
            previous = result.q
            qpos[t], iterations[t], violations[t] = result.q, result.iterations, result.violations
            energy[t] = self.mesh.energy(self.configuration)
            seconds[t] = perf_counter() - start
            if progress is not None:
                progress(t + 1, frames)
        tolerance = relaxation_tolerance(options)
        record = SolveRecord(
            energy=energy,
            iterations=iterations,
            relaxed=np.any(violations > tolerance, axis=1),
            violations={name: violations[:, i] for i, name in enumerate(RELAXATIONS)},
            seconds=seconds,
        )
        return Retargeted(
            self.robot.name,
            self.source.fps,
            qpos,
            self.source.object_poses,
            self.source,
            self.options,
            record,
            self.nominal_motion,
        )

    def _ahead(self, before: np.ndarray, previous: np.ndarray) -> np.ndarray:
        """Where most of the last step leads when taken again: a better start than staying."""
        self.configuration.update(previous)
        q = self.configuration.step(-_AHEAD * self.configuration.difference(before))
        q[7:] = np.clip(q[7:], *self.robot.reference_joint_ranges.T)
        return q

    def _place(self, t: int) -> None:
        """Sets the scene, the mesh and the nominal pose to frame t."""
        self.mesh.set_frame(t)
        self.soles.set_frame(t)
        if self.orientation is not None:
            self.orientation.set_frame(t)
        if self.nominal is not None:
            self.nominal.set_frame(t)
        if self.source.object_poses is not None:
            self.configuration.place_object(self.source.object_poses[t])

    def _first(self) -> FrameResult:
        """Frame 0 without stance, previous frame or trust region: the best of several starts."""
        self._place(0)
        self.smoothness.set_target(None)
        if self.velocity is not None:
            self.velocity.set_previous(None)
        best: FrameResult | None = None
        lowest = np.inf
        options = self.options
        starts = aligned_poses(self.configuration, self.source.keypoints[0])
        if self.nominal_motion is not None:
            starts = [self.nominal_motion[0]]
        for pose in starts:
            result = self.solver.solve(
                pose,
                options.first_iterations // 2,
                2 * options.trust_region,
                10 * options.convergence,
            )
            energy = self.mesh.energy(self.configuration) + 1e3 * max(result.violations)
            if energy < lowest:
                best, lowest = result, energy
        assert best is not None
        return self.solver.solve(best.q, options.first_iterations, options.trust_region, _FIRST)

    def _cost(self) -> float:
        """Value of mesh and contacts."""
        energy = self.mesh.energy(self.configuration)
        return 0.5 * self.options.laplacian_weight * energy + self.touch.value(self.configuration)

    def _value(self, result: FrameResult) -> float:
        """Cost of a result, where the configuration is, and of what it violates."""
        excess = np.array(result.violations) - self.options.restoration_tolerance
        return self.solver.cost() + float(_FORBIDDEN @ np.maximum(excess, 0.0))

    def _freed(self, pose: np.ndarray, caught: FrameResult) -> FrameResult:
        """Solves a frame from another pose, as near to that as speed limits let it start.

        Args:
            pose: (nq,) where it was a frame before, or where a robot that nothing stops would be.
            caught: The result to beat.

        Returns:
            The better result; the configuration is there.
        """
        options = self.options
        before = self._value(caught)
        start = pose if self.velocity is None else self.velocity.nearest(self.configuration, pose)
        freed = self.solver.solve(
            start, options.iterations, options.trust_region, options.convergence
        )
        if self._value(freed) < _BETTER * before:
            return replace(freed, iterations=caught.iterations + freed.iterations)
        self.configuration.update(caught.q)
        return caught

    def _sketch(self, first: np.ndarray) -> Sketch:
        """Draws a sketch that begins with the (nq,) configuration of frame 0."""
        frames = sketched_frames(self.source.num_frames)
        qpos = np.tile(first, (len(frames), 1))
        feet, costs = np.empty((len(frames), 2, 3, 3)), np.empty(len(frames))
        options = self.options
        for i, t in enumerate(frames):
            self._place(t)
            self.touch.set_frame(t)
            if i == 0:
                self.configuration.update(first)
            else:
                self.smoothness.set_target(qpos[i - 1])
                radius = (t - frames[i - 1]) * options.trust_region
                qpos[i] = self.through_walls.solve(
                    qpos[i - 1],
                    options.iterations,
                    radius,
                    _COARSE * options.convergence,
                    restore=False,
                ).q
            feet[i], costs[i] = self.configuration.feet(), self._cost()
        self.touch.set_frame(None)
        return Sketch(frames, qpos, feet, costs)

    def _plan(self, sketch: Sketch) -> StancePlan:
        """Plans the footholds near where the feet of a sketch went."""
        source, tier = self.source, self.tier
        wishes = sketch.foot_wishes(source)
        if self.nominal_motion is not None:
            # The paper's p_0^F = p̄_0^F: feet that stand on frame 0 stand where the nominal ones do.
            first = self.nominal_motion[0]
            self.configuration.update(first)
            start = foot_wishes(self.configuration.feet()[None])
            standing = np.logical_and.accumulate(tier == ANCHORED)
            wishes.tips[standing] = np.broadcast_to(start.tips, wishes.tips.shape)[standing]
            turn = start.headings - wishes.headings[:1]
            same = start.headings - 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
            wishes.headings[standing] = np.broadcast_to(same, tier.shape)[standing]
        return plan_stance(
            tier,
            wishes,
            self.configuration.foot_width,
            self.human_feet,
            source.fps,
            self.options.stance,
        )
