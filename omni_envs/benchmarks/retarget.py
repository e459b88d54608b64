"""Speed and memory of retargeting, beside the inverse kinematics of GMR in the same run."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from pkgutil import iter_modules
from time import perf_counter, process_time
from typing import Any, TypeVar

import numpy as np

from omni_envs import retargeting
from omni_envs.benchmarks.memory import peak_bytes
from omni_envs.benchmarks.stages import StageSampler
from omni_envs.demonstrations import (
    Demonstration,
    SourceMotion,
    load_demonstration,
    scale_demonstration,
)
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.comparators import GMR_MATCHES, gmr_retarget
from omni_envs.robots import Robot, get_robot
from omni_envs.threads import one_maths_thread

STAGES = {
    "interaction_mesh": "mesh",
    "surface_points": "mesh",
    "kinematics": "kinematics",
    "contact_limit": "collision",
    "solver": "qp",
    "stance_plan": "footholds",
    "foot_room": "footholds",
    "sketch": "footholds",
    "frame_solver": "loop",
    "restoration": "restoration",
    "retarget": "loop",
}
"""Module of ``omni_envs.retargeting`` to the stage its own time counts for; the others, all tasks
and limits, are ``"assembly"`` of the quadratic program."""

WHOLE_STAGES = {"restore": "restoration", "_sketch": "footholds"}
"""Functions whose whole time is one stage, callees included."""

_T = TypeVar("_T")
_WALL, _CPU = 0, 1
_WARM_UP_FRAMES = 3
_PROFILED_RUNS = 2
# A source this far away is the same to the eye and another to the cache of interaction meshes.
_NUDGE = 1e-5


def bench_retarget(
    source: str | Path | Demonstration,
    *,
    robot: str = "g1",
    repeats: int = 3,
    options: RetargetOptions | None = None,
) -> dict[str, Any]:
    """Measures retargeting on one thread, in a process of its own.

    Every repeat runs, one after the other, our retargeting with a new interaction mesh (cold), our
    own implementation of GMR, and our retargeting again with the mesh at hand (cached), so that
    whatever else the machine does hits all alike. Imports, compilation of models and kernels, and
    reading and scaling the demonstration are not counted.

    Args:
        source: A demonstration, its file, or the name of a built-in one.
        robot: Name of the robot.
        repeats: How often to measure; medians count.
        options: Settings of the retargeting.

    Returns:
        - ``frames``, ``repeats``.
        - ``frames_per_s_cold``, ``frames_per_s_cached``, ``gmr_frames_per_s``: by the clock.
        - ``cpu_frames_per_s_cold``, ``cpu_frames_per_s_cached``, ``cpu_gmr_frames_per_s``: by the
          time the process had a core, the same on a quiet machine.
        - ``ratio_to_gmr``, ``ratio_to_gmr_cold``: of the CPU times within a repeat.
        - ``iterations_per_frame``, ``gmr_iterations_per_frame``: quadratic programs.
        - ``peak_memory_mb`` of the process after the first cold run.
        - ``compile_s``: CPU time that the first run in a process takes beyond the next, for models
          and kernels; long only on the first run ever, as kernels are kept on disk.
        - ``ms_per_frame`` of CPU in a cold run and its parts ``ms_<stage>``, on POSIX systems.

        GMR's figures are None for robots without a table, memory where the system keeps it secret.

    Raises:
        InvalidOptionError: repeats < 1.
        OmniEnvsError: The demonstration cannot be read or retargeted.
    """
    if repeats < 1:
        raise InvalidOptionError(f"bench_retarget: repeats must be at least 1; got {repeats}.")
    get_robot(robot)
    demonstration = source if isinstance(source, Demonstration) else load_demonstration(source)
    # A fresh process: thread counts are read when numpy loads, and the peak of memory is its own.
    with one_maths_thread(), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_measure_safely, demonstration, robot, repeats, options).result()


def _measure_safely(*arguments: Any) -> dict[str, Any]:
    try:
        return measure(*arguments)
    except OmniEnvsError as error:
        # Errors with several arguments do not travel between processes.
        raise OmniEnvsError(str(error)) from None


def measure(
    demonstration: Demonstration, robot: str, repeats: int, options: RetargetOptions | None = None
) -> dict[str, Any]:
    """Measures in this process, with the threads it has; see ``bench_retarget``."""
    machine = get_robot(robot)
    motion = scale_demonstration(demonstration, machine.height)
    with_gmr = robot in GMR_MATCHES
    warm_up = _first_frames(demonstration, _WARM_UP_FRAMES)
    short = scale_demonstration(warm_up, machine.height)
    starts = _Times()
    for _ in range(2):
        starts.run(retarget, short, machine, options)
    first, second = starts.seconds
    if with_gmr:
        gmr_retarget(warm_up, machine)
    cold, cached, gmr = _Times(), _Times(), _Times()
    peak: int | None = None
    for i in range(repeats):
        fresh = _nudged(motion, i + 1)
        cold.run(retarget, fresh, machine, options)
        peak = peak or peak_bytes()
        if with_gmr:
            theirs = gmr.run(gmr_retarget, demonstration, machine)
            # Without what comes before the first frame.
            gmr.seconds[-1] *= theirs.seconds.sum() / gmr.seconds[-1][_WALL]
        ours = cached.run(retarget, fresh, machine, options)
    frames = motion.num_frames
    cold_speed, cached_speed = frames / cold.median(), frames / cached.median()
    gmr_speed = frames / gmr.median() if with_gmr else (None, None)
    rows = {
        "frames": frames,
        "repeats": repeats,
        "frames_per_s_cold": cold_speed[_WALL],
        "frames_per_s_cached": cached_speed[_WALL],
        "gmr_frames_per_s": gmr_speed[_WALL],
        "cpu_frames_per_s_cold": cold_speed[_CPU],
        "cpu_frames_per_s_cached": cached_speed[_CPU],
        "cpu_gmr_frames_per_s": gmr_speed[_CPU],
        "ratio_to_gmr": cached.times_faster_than(gmr) if with_gmr else None,
        "ratio_to_gmr_cold": cold.times_faster_than(gmr) if with_gmr else None,
        "iterations_per_frame": float(ours.frames.iterations.mean()),
        "gmr_iterations_per_frame": float(theirs.iterations.mean()) if with_gmr else None,
        "peak_memory_mb": None if peak is None else peak / 1e6,
        "compile_s": float(first[_CPU] - second[_CPU]),
        "ms_per_frame": 1e3 / cold_speed[_CPU],
    }
    if StageSampler.available():
        shares = _stage_shares(motion, machine, options, repeats)
        rows |= {f"ms_{stage}": share * rows["ms_per_frame"] for stage, share in shares.items()}
    return rows


class _Times:
    """Seconds of repeated runs, by the clock and of CPU."""

    def __init__(self) -> None:
        self.seconds: list[np.ndarray] = []

    def run(self, call: Callable[..., _T], *arguments: Any) -> _T:
        wall, cpu = perf_counter(), process_time()
        result = call(*arguments)
        self.seconds.append(np.array([perf_counter() - wall, process_time() - cpu]))
        return result

    def median(self) -> np.ndarray:
        return np.median(self.seconds, axis=0)

    def times_faster_than(self, other: _Times) -> float:
        """Ratio of CPU times: the median of runs that belong together."""
        pairs = zip(other.seconds, self.seconds, strict=True)
        return float(np.median([theirs[_CPU] / ours[_CPU] for theirs, ours in pairs]))


def _stage_shares(
    motion: SourceMotion, robot: Robot, options: RetargetOptions | None, runs: int
) -> dict[str, float]:
    """Share of every stage in cold runs of their own, which the sampling may slow down."""
    modules = {
        f"{retargeting.__name__}.{module.name}": STAGES.get(module.name, "assembly")
        for module in iter_modules(retargeting.__path__)
    }
    sampler = StageSampler(modules, WHOLE_STAGES)
    for i in range(_PROFILED_RUNS):
        fresh = _nudged(motion, runs + 1 + i)
        with sampler:
            retarget(fresh, robot, options)
    return sampler.shares()


def _nudged(motion: SourceMotion, times: int) -> SourceMotion:
    """The same motion as far as anyone can see, with an interaction mesh of its own."""
    keypoints = motion.keypoints.copy()
    keypoints[:, 0] += _NUDGE * times
    return replace(motion, keypoints=keypoints)


def _first_frames(demonstration: Demonstration, count: int) -> Demonstration:
    def cut(array: np.ndarray | None) -> np.ndarray | None:
        return None if array is None else array[:count]

    return replace(
        demonstration,
        positions=demonstration.positions[:count],
        orientations=cut(demonstration.orientations),
        object_poses=cut(demonstration.object_poses),
        contacts={link: flags[:count] for link, flags in demonstration.contacts.items()},
    )
