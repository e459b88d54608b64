"""Where items are made: processes of this machine, or a Ray cluster. Both run ``make_item``."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from omni_envs.errors import MissingDependencyError, OmniEnvsError
from omni_envs.generation.item import Item, make_item
from omni_envs.processes import end_with_parent
from omni_envs.robots import Robot, adopt_robots, get_robot
from omni_envs.threads import one_maths_thread

Engine = Callable[[Sequence[Item], str, int], Iterator[dict[str, Any]]]
"""(items, folder of the dataset, workers) → rows as they are finished."""


def run_local(items: Sequence[Item], out: str, jobs: int) -> Iterator[dict[str, Any]]:
    """Makes items in processes of one maths thread each.

    Raises:
        OmniEnvsError: A process died, e.g. for lack of memory; what was finished stays.
    """
    context = multiprocessing.get_context("spawn")
    jobs = min(jobs, len(items))
    with (
        one_maths_thread(),
        ProcessPoolExecutor(
            min(jobs, len(items)), context, adopt_robots, (_robots(items),)
        ) as pool,
    ):
        futures = [pool.submit(make_item, item, out) for item in items]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BrokenProcessPool as error:
            raise OmniEnvsError(
                "A process that made references died (killed, or out of memory). What it had "
                "finished is kept: run the same command again to go on, with fewer --jobs."
            ) from error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def run_ray(items: Sequence[Item], out: str, jobs: int) -> Iterator[dict[str, Any]]:
    """Makes items on the Ray cluster of this machine's address, or one of its own.

    The dataset's folder and the sources must be at the same place on every machine.

    Raises:
        MissingDependencyError: Ray is not installed.
    """
    try:
        import ray
    except ImportError as error:
        raise MissingDependencyError("ray", "ray", "The engine 'ray'") from error
    mine = not ray.is_initialized()
    if mine:
        ray.init(num_cpus=jobs, log_to_driver=False, include_dashboard=False)
    try:
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        task = ray.remote(num_cpus=1, runtime_env={"env_vars": threads})(_make)
        robots = ray.put(_robots(items))
        pending = [task.remote(item, out, robots) for item in items]
        while pending:
            ready, pending = ray.wait(pending, num_returns=1)
            yield from ray.get(ready)
    finally:
        if mine:
            ray.shutdown()


def _robots(items: Sequence[Item]) -> tuple[Robot, ...]:
    """The robots themselves: a worker cannot know those that this process alone has registered."""
    return tuple(get_robot(name) for name in dict.fromkeys(item.robot for item in items))


def _start_worker(robots: tuple[Robot, ...]) -> None:
    end_with_parent()
    adopt_robots(robots)


def _make(item: Item, out: str, robots: tuple[Robot, ...]) -> dict[str, Any]:
    adopt_robots(robots)
    return make_item(item, out)


ENGINES: dict[str, Engine] = {"local": run_local, "ray": run_ray}
"""Name to engine."""
