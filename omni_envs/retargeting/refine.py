"""Clip-level refinement: all frames of a motion together, as smooth as the constraints allow.

The frame-by-frame pass cannot see ahead, so contacts that come and go make it jerk. Here a few
rounds of sequential quadratic programming move all frames at once (``clip_program``,
``interior_point``), each within a smaller box about the last motion. What linearisation leaves
violated is restored on true distances, frame after frame, with speed limits about the restored
frame before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from omni_envs.errors import InvalidOptionError
from omni_envs.progress import ProgressCallback
from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.detour import led_around
from omni_envs.retargeting.interior_point import solve_clip_qp
from omni_envs.retargeting.joint_limits import JointLimit, StepVelocityLimit
from omni_envs.retargeting.limits import BoundLimit
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.qp import step_bounds
from omni_envs.retargeting.restoration import restore
from omni_envs.retargeting.result import RELAXATIONS, Retargeted, SolveRecord
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.retargeting.tangents import moved
from omni_envs.robots import KEYPOINTS, Robot, get_robot

# Frames solved at once, and frames on either side that are solved with them and thrown away: the
# influence of a frame has faded there.
_WINDOW, _CONTEXT = 320, 24
_RELAXED = 2e-4
_EARLY = 10.0  # rounds before the last are solved to this many times the tolerance


@dataclass(frozen=True)
class RefineOptions:
    """Settings of ``refine``.

    Attributes:
        acceleration_weight: Weight of the squared acceleration (metric S, SI units) against the
            weighted deformation energy, on every frame.
        radii: Half width of the box about the motion, one per round, m and rad.
        tolerance: Complementarity gap to solve the program of the last round to.
    """

    acceleration_weight: float = 5e-6
    radii: tuple[float, ...] = (0.4, 0.05, 0.01)
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        for name in ("acceleration_weight", "tolerance"):
            if not getattr(self, name) > 0:
                raise InvalidOptionError(
                    f"RefineOptions: {name} must be positive; got {getattr(self, name)!r}."
                )
        if not self.radii or not all(radius > 0 for radius in self.radii):
            raise InvalidOptionError(
                f"RefineOptions: radii must be positive, at least one; got {self.radii!r}."
            )


def refine(
    retargeted: Retargeted,
    options: RefineOptions | None = None,
    progress: ProgressCallback | None = None,
) -> Retargeted:
    """Smooths a retargeted motion under the constraints it was made with.

    Stance is kept relative to the motion given: feet stay where it put them. Where that motion
    violates a constraint so may the result, and its record says by how much.

    Args:
        retargeted: Result of ``retarget``.
        options: Settings.
        progress: Called with (frames done, frames in all), counting every round.

    Returns:
        The refined motion, its record brought up to date.
    """
    options = options or RefineOptions()
    begin = perf_counter()
    robot, frames = get_robot(retargeted.robot), retargeted.num_frames
    qpos = retargeted.qpos
    program = ClipProgram(
        retargeted.source,
        robot,
        retargeted.options,
        options.acceleration_weight,
        qpos,
        retargeted.nominal,
    )
    total = frames * (len(options.radii) + 1)
    for number, radius in enumerate(options.radii):
        last = number == len(options.radii) - 1
        tolerance = options.tolerance if last else _EARLY * options.tolerance
        x = np.zeros((frames, robot.nv))
        for start, stop, keep in _windows(frames):
            solution = solve_clip_qp(program.linearise(qpos, start, stop, radius), tolerance)
            x[keep] = solution.x[keep.start - start : keep.stop - start]
            if progress is not None:
                progress(number * frames + keep.stop, total)
        qpos = moved(qpos, x)
    qpos = led_around(program, retargeted.qpos, qpos, options.tolerance)

    restoration = _Restoration(program, robot, retargeted.options)
    qpos = qpos.copy()
    steps, violations = np.empty(frames, int), np.empty((frames, 3))
    keypoints = np.empty((frames, len(KEYPOINTS), 3))
    for t in range(frames):
        qpos[t], steps[t], violations[t] = restoration.restore(t, qpos[t])
        keypoints[t] = program.configuration.keypoints()
        if progress is not None:
            progress(total - frames + t + 1, total)
    energy = program.mesh.energy(keypoints)
    record = _record(retargeted, energy, steps, violations, perf_counter() - begin)
    return replace(retargeted, qpos=qpos, frames=record)


def _windows(frames: int) -> Iterator[tuple[int, int, slice]]:
    """Start and stop of the frames to solve at once, and which of them to keep."""
    count = max(1, round(frames / _WINDOW))
    edges = np.linspace(0, frames, count + 1).round().astype(int)
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield max(0, first - _CONTEXT), min(frames, last + _CONTEXT), slice(first, last)


def _record(
    before: Retargeted,
    energy: np.ndarray,
    steps: np.ndarray,
    violations: np.ndarray,
    seconds: float,
) -> SolveRecord:
    old = before.frames
    current = {name: violations[:, i] for i, name in enumerate(RELAXATIONS)}
    if "stance" in old.violations:
        # Stance is kept relative to the motion before: what that missed is still missed.
        current["stance"] = np.maximum(current["stance"], old.violations["stance"])
    tolerance = max(_RELAXED, before.options.restoration_tolerance)
    return SolveRecord(
        energy=energy,
        iterations=old.iterations + steps,
        relaxed=np.any(np.stack(list(current.values())) > tolerance, axis=0),
        violations=current,
        seconds=old.seconds + seconds / len(energy),
    )


class _Restoration:
    """Shortest steps of successive frames onto the true constraints."""

    def __init__(self, program: ClipProgram, robot: Robot, options: RetargetOptions) -> None:
        self._program, self._options = program, options
        self._bounds: list[BoundLimit] = [JointLimit(robot)]
        self._velocity: StepVelocityLimit | None = None
        if options.velocity_limits is not None:
            self._velocity = StepVelocityLimit(robot, program.source.fps, options.velocity_limits)
            self._bounds.append(self._velocity)
        self._previous: np.ndarray | None = None

    def restore(self, t: int, q: np.ndarray) -> tuple[np.ndarray, int, tuple[float, ...]]:
        """Restores frame t after frame t - 1.

        Returns:
            The configuration, quadratic programs solved, and what remains violated, in the order of
            ``RELAXATIONS``.
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
