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
from omni_envs.retargeting.clip_restoration import RestoredClip, restore_clip
from omni_envs.retargeting.detour import led_around, led_back, smoothed_again
from omni_envs.retargeting.interior_point import solve_clip_qp
from omni_envs.retargeting.result import (
    RELAXATIONS,
    Retargeted,
    SolveRecord,
    relaxation_tolerance,
)
from omni_envs.retargeting.tangents import moved
from omni_envs.robots import get_robot

# Frames solved at once, and frames on either side that are solved with them and thrown away: the
# influence of a frame has faded there.
_WINDOW, _CONTEXT = 320, 24
# How often a motion that cannot be restored is mended; frames about the first of those, and how far
# another first one is from it.
_ATTEMPTS, _ABOUT, _APART = 6, 8, 40
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
    violates a constraint so may the result, and its record says by how much; elsewhere the result
    goes back to that motion sooner than violate one.

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

    restored = _restored(program, retargeted, qpos, options, progress)
    return replace(
        retargeted,
        qpos=restored.qpos,
        frames=_record(retargeted, restored, perf_counter() - begin),
    )


def _restored(
    program: ClipProgram,
    before: Retargeted,
    qpos: np.ndarray,
    options: RefineOptions,
    progress: ProgressCallback | None,
) -> RestoredClip:
    """Restores a smoothed motion; where that fails, the motion gives way, not its constraints."""
    best = latest = restore_clip(program, before.options, qpos, progress, len(options.radii))
    for attempt in range(_ATTEMPTS):
        forced = np.flatnonzero(latest.relaxed & ~before.frames.relaxed)
        if not len(forced):
            break
        # One missed landing spoils the whole stance after it.
        first = forced[np.diff(forced, prepend=-_APART) >= _APART]
        about = np.unique(first[:, None] + np.arange(-_ABOUT, _ABOUT + 1))
        about = about[(about >= 0) & (about < len(qpos))]
        if attempt == 0:
            qpos = smoothed_again(program, before.qpos, qpos, options.tolerance, about)
        else:
            qpos = led_back(before.qpos, qpos, about)
        latest = restore_clip(program, before.options, qpos)
        if latest.relaxed.sum() < best.relaxed.sum():
            best = latest
    return best


def _windows(frames: int) -> Iterator[tuple[int, int, slice]]:
    """Start and stop of the frames to solve at once, and which of them to keep."""
    count = max(1, round(frames / _WINDOW))
    edges = np.linspace(0, frames, count + 1).round().astype(int)
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield max(0, first - _CONTEXT), min(frames, last + _CONTEXT), slice(first, last)


def _record(before: Retargeted, restored: RestoredClip, seconds: float) -> SolveRecord:
    old = before.frames
    current = {name: restored.violations[:, i] for i, name in enumerate(RELAXATIONS)}
    if "stance" in old.violations:
        # Stance is kept relative to the motion before: what that missed is still missed.
        current["stance"] = np.maximum(current["stance"], old.violations["stance"])
    tolerance = relaxation_tolerance(before.options)
    return SolveRecord(
        energy=restored.energy,
        iterations=old.iterations + restored.steps,
        relaxed=np.any(np.stack(list(current.values())) > tolerance, axis=0),
        violations=current,
        seconds=old.seconds + seconds / len(old.seconds),
    )
