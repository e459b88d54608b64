"""Every figure of speed in one run: beside raw physics, Gymnasium's own, and processes."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv

from omni_envs import registration
from omni_envs.benchmarks.memory import peak_bytes, reset_peak
from omni_envs.benchmarks.step import (
    aim,
    bench_humanoid,
    bench_single,
    bench_step,
    make_vector,
)

WORKERS = 8
"""Processes of Gymnasium's ``AsyncVectorEnv``: few, where it is fastest on few cores."""

SLICE = 0.5
"""Time that ``AsyncVectorEnv`` and ours run in turns, s."""


def bench_environments(
    env: str = "OmniEnvs/G1BoxCarry-v0",
    num_envs: Sequence[int] = (64, 256),
    num_threads: Sequence[int] = (1, 0),
    *,
    seconds: float = 5.0,
    seed: int = 0,
    **options: Any,
) -> dict[str, Any]:
    """Measures everything: see the keys.

    Args:
        env: Environment id.
        num_envs: Sizes of the vector environment.
        num_threads: Numbers of physics threads; 0 takes every core.
        seconds: How long to measure for each row.
        seed: Seed of environments and actions.
        **options: Options of the environment.

    Returns:
        ``vector``: ``bench_step`` for every size and number of threads; ``single``:
        ``bench_single``; ``humanoid``: ``bench_humanoid``; ``asynchronous``: ``bench_async`` of
        the smallest size beside ``WORKERS`` processes and beside as many as simulations;
        ``construct_seconds`` and ``bytes_per_env`` of the largest size, in a process of its own;
        ``steps_per_s``, ``raw_steps_per_s`` and ``ratio`` of the largest size and most threads.
    """
    cores = os.cpu_count() or 1
    threads = sorted({t or cores for t in num_threads})
    make_vector(env, 1, 1, options).close()  # refuses bad options, and makes the reference
    common: dict[str, Any] = {"seconds": seconds, "seed": seed, **options}
    # Processes come first: they are forked from this one, which has no threads yet.
    asynchronous = [
        bench_async(env, min(num_envs), max(threads), workers=n, **common)
        for n in sorted({WORKERS, min(num_envs)})
    ]
    rows = [bench_step(env, n, num_threads=t, **common) for n in sorted(num_envs) for t in threads]
    single = bench_single(env, **common)
    largest = rows[-1]
    return {
        "vector": rows,
        "single": single,
        "humanoid": bench_humanoid(seconds=seconds, seed=seed),
        "asynchronous": asynchronous,
        **measure_memory(env, max(num_envs), max(threads), **options),
        **{key: largest[key] for key in ("steps_per_s", "raw_steps_per_s", "ratio")},
    }


def bench_async(
    env: str,
    num_envs: int,
    num_threads: int,
    *,
    workers: int = WORKERS,
    seconds: float = 5.0,
    seed: int = 0,
    **options: Any,
) -> dict[str, Any]:
    """Measures the vector environment beside ``AsyncVectorEnv`` of the single one, in turns.

    Args:
        env: Environment id.
        num_envs: Size of ours.
        num_threads: Physics threads of ours.
        workers: Simulations of the other, each a process.
        seconds: How long to measure.
        seed: Seed of environments and actions.
        **options: Options of the environment.

    Returns:
        ``steps_per_s``, ``async_steps_per_s`` and ``ratio``, medians over the turns.
    """
    one = partial(_make_one, env, options)
    other = AsyncVectorEnv([one] * workers)
    ours = make_vector(env, num_envs, num_threads, options)
    rng = np.random.default_rng(seed)
    states = [other.reset(seed=seed)[0], ours.reset(seed=seed)[0]]
    rates: list[list[float]] = [[], []]
    finish = time.perf_counter() + seconds
    while time.perf_counter() < finish or len(rates[0]) < 3:
        for k, environment in enumerate((other, ours)):
            steps, spent = 0, 0.0
            while spent < SLICE or steps == 0:
                actions = aim(ours, states[k], rng)
                started = time.perf_counter()
                states[k] = environment.step(actions)[0]
                spent += time.perf_counter() - started
                steps += environment.num_envs
            rates[k].append(steps / spent)
    other.close()
    ours.close()
    theirs, rate = np.array(rates)
    return {
        "steps_per_s": float(np.median(rate)),
        "async_steps_per_s": float(np.median(theirs)),
        "ratio": float(np.median(rate / theirs)),
        "workers": workers,
    }


def measure_memory(env: str, num_envs: int, num_threads: int = 0, **options: Any) -> dict[str, Any]:
    """Makes and runs a vector environment in a fresh process.

    Returns:
        ``construct_seconds``, and ``bytes_per_env``: growth of the process's peak, None where the
        system does not tell.
    """
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(_grow, env, num_envs, num_threads, options).result()


def _grow(env: str, num_envs: int, num_threads: int, options: dict[str, Any]) -> dict[str, Any]:
    make_vector(env, 1, 1, options).close()  # what is loaded once is no growth
    base = reset_peak()
    started = time.perf_counter()
    vector = make_vector(env, num_envs, num_threads, options)
    construct = time.perf_counter() - started
    rng = np.random.default_rng(0)
    observations, _ = vector.reset(seed=0)
    for _ in range(8):
        observations = vector.step(aim(vector, observations, rng))[0]
    peak = peak_bytes()
    memory = None if peak is None or base is None else round((peak - base) / num_envs)
    return {"construct_seconds": construct, "bytes_per_env": memory}


def _make_one(env: str, options: dict[str, Any]) -> gymnasium.Env:
    registration.register_all()  # a process may be new, not forked
    return gymnasium.make(env, disable_env_checker=True, **options)
