"""Many references at once: independent demonstrations over processes."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing.context import BaseContext
from typing import Any

from omni_envs.demonstrations import Demonstration
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.processes import end_with_parent
from omni_envs.progress import ProgressCallback
from omni_envs.references.build import make_reference
from omni_envs.references.reference import Reference
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import Robot, adopt_robots, get_robot
from omni_envs.threads import one_maths_thread

_POLL_SECONDS = 0.2
_MODULE = "omni_envs.references.parallel"

_counter: Any = None
"""In a worker: the count of solved frames, shared by all processes."""


def make_references(
    demonstrations: Sequence[Demonstration],
    robot: str | Robot,
    *,
    fps: float = 50.0,
    options: RetargetOptions | None = None,
    jobs: int | None = None,
    progress: ProgressCallback | None = None,
) -> list[Reference | OmniEnvsError]:
    """Makes one reference per demonstration, over processes of one maths thread each.

    A demonstration that cannot be used does not stop the others.

    Args:
        demonstrations: The human motions.
        robot: The robot or its name.
        fps: Frames per second of the references.
        options: Settings of the retargeter.
        jobs: Processes; one per core by default.
        progress: Called with (frames done, frames in all).

    Returns:
        In the order of the demonstrations, the reference or the error that there was instead.

    Raises:
        InvalidOptionError: ``jobs`` is less than 1.
    """
    robot = get_robot(robot)
    jobs = (os.cpu_count() or 1) if jobs is None else jobs
    if jobs < 1:
        raise InvalidOptionError(f"jobs must be at least 1; got {jobs}.")
    jobs = min(jobs, max(len(demonstrations), 1))
    frames = [max(round(d.num_frames * fps / d.fps), 1) for d in demonstrations]
    total = sum(frames)
    context = worker_context()
    counter = context.Value("q", 0)
    with (
        one_maths_thread(),
        ProcessPoolExecutor(jobs, context, _start_worker, (counter, robot)) as pool,
    ):
        # Long clips first, so that no process ends up alone with one.
        order = sorted(range(len(demonstrations)), key=lambda i: -frames[i])
        futures: dict[int, Future[Reference | OmniEnvsError]] = {
            i: pool.submit(_make, demonstrations[i], robot, fps, options) for i in order
        }
        pending = set(futures.values())
        while pending:
            _, pending = wait(pending, _POLL_SECONDS, FIRST_COMPLETED)
            if progress is not None:
                progress(min(counter.value, total) if pending else total, total)
        return [futures[i].result() for i in range(len(demonstrations))]


def worker_context() -> BaseContext:
    """How workers are started: from a server that has imported all they need, where there is one.

    Importing takes longer than a short clip. The server does it once, and stays for later calls.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_MODULE])
    return context


def _start_worker(counter: Any, robot: Robot) -> None:
    global _counter
    _counter = counter
    end_with_parent()
    adopt_robots((robot,))


def _make(
    demonstration: Demonstration, robot: Robot, fps: float, options: RetargetOptions | None
) -> Reference | OmniEnvsError:
    seen = 0

    def count(done: int, total: int) -> None:
        nonlocal seen
        with _counter.get_lock():
            _counter.value += done - seen
        seen = done

    try:
        return make_reference(demonstration, robot, fps=fps, options=options, progress=count)
    except OmniEnvsError as error:
        # Subclasses take other arguments than their message, so they do not unpickle.
        return OmniEnvsError(str(error))
