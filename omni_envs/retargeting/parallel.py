"""Many clips at once: independent clips run in processes of their own."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import InvalidOptionError
from omni_envs.progress import ProgressCallback
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.refine import refine
from omni_envs.retargeting.result import Retargeted
from omni_envs.retargeting.retarget import retarget
from omni_envs.robots import Robot

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def retarget_many(
    sources: Sequence[SourceMotion],
    robot: Robot,
    options: RetargetOptions | None = None,
    jobs: int | None = None,
    progress: ProgressCallback | None = None,
) -> list[Retargeted]:
    """Retargets clips in parallel, and refines them where the options say so.

    Args:
        sources: The clips, at the robot's scale.
        robot: The robot.
        options: Settings.
        jobs: Processes; None takes one per processor. With 1 everything runs in this process.
        progress: Called with (frames done, frames in all) as clips are finished.

    Returns:
        One motion per clip, in their order.

    Raises:
        InvalidOptionError: ``jobs`` is less than 1.
        InvalidDataError: A source is not finite, has no frames or no frame rate.
    """
    options = options or RetargetOptions()
    if jobs is not None and jobs < 1:
        raise InvalidOptionError(f"jobs must be at least 1; got {jobs}.")
    jobs = min(jobs or os.cpu_count() or 1, max(len(sources), 1))
    total, done = sum(source.num_frames for source in sources), 0
    motions: dict[int, Retargeted] = {}
    for index, motion in _solved(sources, robot, options, jobs):
        motions[index] = motion
        done += motion.num_frames
        if progress is not None:
            progress(done, total)
    return [motions[i] for i in range(len(sources))]


def _solved(
    sources: Sequence[SourceMotion], robot: Robot, options: RetargetOptions, jobs: int
) -> Iterator[tuple[int, Retargeted]]:
    if jobs == 1:
        for i, source in enumerate(sources):
            yield i, _one(source, robot, options)
        return
    # Spawned, not forked: a fork copies the locks of threads that do not come along.
    context = multiprocessing.get_context("spawn")
    with _single_threads(), ProcessPoolExecutor(jobs, context) as pool:
        # The longest first, so that no process is left with a long clip at the end.
        order = sorted(range(len(sources)), key=lambda i: -sources[i].num_frames)
        running = {pool.submit(_one, sources[i], robot, options): i for i in order}
        for finished in as_completed(running):
            yield running[finished], finished.result()


def _one(source: SourceMotion, robot: Robot, options: RetargetOptions) -> Retargeted:
    motion = retarget(source, robot, options)
    return refine(motion) if options.refine else motion


@contextmanager
def _single_threads() -> Iterator[None]:
    """One BLAS thread per process: more would only fight over the same processors."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
