"""Restoration of a whole motion on true distances, frame after frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.progress import ProgressCallback
from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.joint_limits import JointLimit, StepVelocityLimit
from omni_envs.retargeting.limits import BoundLimit
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.qp import step_bounds
from omni_envs.retargeting.restoration import restore
from omni_envs.retargeting.result import relaxation_tolerance
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.robots import KEYPOINTS


@dataclass(frozen=True, eq=False)
class RestoredClip:
    """A restored motion.

    Attributes:
        qpos: (T, nq) configurations.
        steps: (T,) quadratic programs solved.
        violations: (T, 3) what remains violated, in the order of ``RELAXATIONS``, m.
        relaxed: (T,) whether that is much.
        energy: (T,) deformation energy, m².
    """

    qpos: np.ndarray
    steps: np.ndarray
    violations: np.ndarray
    relaxed: np.ndarray
    energy: np.ndarray


def restore_clip(
    program: ClipProgram,
    options: RetargetOptions,
    qpos: np.ndarray,
    progress: ProgressCallback | None = None,
    rounds_before: int = 0,
) -> RestoredClip:
    """Moves all frames by the shortest steps onto their constraints, speed limits included.

    Args:
        program: The program of the clip.
        options: How the motion was made.
        qpos: (T, nq) the motion.
        progress: Called with (frames done, frames in all).
        rounds_before: How often all frames were counted before.
    """
    frames, done = len(qpos), rounds_before * len(qpos)
    qpos, restoration = qpos.copy(), _Restoration(program, options)
    steps, violations = np.empty(frames, int), np.empty((frames, 3))
    keypoints = np.empty((frames, len(KEYPOINTS), 3))
    for t in range(frames):
        qpos[t], steps[t], violations[t] = restoration.restore(t, qpos[t])
        keypoints[t] = program.configuration.keypoints()
        if progress is not None:
            progress(done + t + 1, done + frames)
    relaxed = np.any(violations > relaxation_tolerance(options), axis=1)
    return RestoredClip(qpos, steps, violations, relaxed, program.mesh.energy(keypoints))


class _Restoration:
    """Shortest steps of successive frames onto the true constraints."""

    def __init__(self, program: ClipProgram, options: RetargetOptions) -> None:
        self._program, self._options = program, options
        self._bounds: list[BoundLimit] = [JointLimit(program.robot)]
        self._velocity: StepVelocityLimit | None = None
        if options.velocity_limits is not None:
            fps = program.source.fps
            self._velocity = StepVelocityLimit(program.robot, fps, options.velocity_limits)
            self._bounds.append(self._velocity)
        self._previous: np.ndarray | None = None

    def restore(self, t: int, q: np.ndarray) -> tuple[np.ndarray, int, tuple[float, ...]]:
        """Restores frame t after frame t - 1.

        Returns:
            The configuration, quadratic programs solved, and what remains violated.
        """
        program, configuration = self._program, self._program.configuration
        program.place(t)
        configuration.update(q)
        program.stance.hold(t)
        if self._velocity is not None:
            self._velocity.set_previous(self._previous)
        # Limits of single joints need no program.
        inside = np.clip(0.0, *step_bounds(configuration, self._bounds))
        if inside.any():
            configuration.update(configuration.step(inside))
        limits = [program.contact, program.stance]
        restored = restore(configuration, self._bounds, limits, solve_daqp, self._options)
        self._previous = configuration.data.qpos.copy()
        program.stance.record(configuration)
        return self._previous, restored.steps, restored.violations
