"""Speed of stepping: an environment beside the physics it runs on, in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import mujoco
import numpy as np
from mujoco.batch import Batch

import omni_envs
from omni_envs import registration
from omni_envs.envs import OmniVectorEnv
from omni_envs.errors import UnknownNameError

SLICE = 4
"""Control steps per timed slice; environment and physics take turns."""

NOISE = 0.2
"""Standard deviation of the actions about those that aim at the reference."""

_STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart")


def bench_step(
    env: str = "OmniEnvs/G1BoxCarry-v0",
    num_envs: int = 64,
    *,
    num_threads: int = 0,
    seconds: float = 10.0,
    seed: int = 0,
    **options: Any,
) -> dict[str, Any]:
    """Measures an environment and the raw physics of the same model on the same states.

    The actions aim at the reference, with noise: episodes start all over it and last for about half
    a second. Raw physics is ``mujoco.batch``: ``step(nstep=substeps)`` with constant controls,
    nothing read, on the same per-simulation models and started from the environment's states before
    every slice. Slices of both take turns, so that whatever else the machine does hits both alike.

    Args:
        env: Environment id.
        num_envs: Simulations.
        num_threads: Physics threads; 0 takes every core.
        seconds: How long to measure.
        seed: Seed of environment and actions.
        **options: Options of the environment.

    Returns:
        ``steps_per_s`` and ``raw_steps_per_s`` (control steps, medians), ``ratio`` (median over the
        pairs of slices), ``bytes_per_env`` (growth of the process by making and running the
        environment), and the conditions.
    """
    base = _resident_bytes()
    started = time.perf_counter()
    vector = _make(env, num_envs, num_threads, options)
    construct = time.perf_counter() - started
    rng = np.random.default_rng(seed)
    observations, _ = vector.reset(seed=seed)
    step = vector.step
    for _ in range(SLICE):
        observations = step(_aim(vector, observations, rng))[0]
    memory = (_resident_bytes() - base) / num_envs
    live = vector.simulation.batch
    raw = Batch(vector.simulation.model, num_envs, live.nthread)
    substeps = vector.config.physics.substeps

    def play() -> float:
        nonlocal observations
        elapsed = 0.0
        for _ in range(SLICE):
            action = _aim(vector, observations, rng)
            begun = time.perf_counter()
            observations = step(action)[0]
            elapsed += time.perf_counter() - begun
        return elapsed

    def load() -> None:
        vector.simulation.copy_models_to(raw)
        for name in _STATE:
            raw.bind(name)[:] = live.bind(name)

    def run() -> float:
        return _timed(lambda: [raw.step(nstep=substeps) for _ in range(SLICE)])

    figures = _turns(play, load, run, SLICE * num_envs, seconds)
    vector.close()
    return figures | {
        "bytes_per_env": round(memory),
        "construct_seconds": construct,
        "num_envs": num_envs,
        "num_threads": live.nthread,
        "version": omni_envs.__version__,
    }


def bench_single(
    env: str = "OmniEnvs/G1BoxCarry-v0", *, seconds: float = 5.0, seed: int = 0, **options: Any
) -> dict[str, float]:
    """Measures the single environment beside a loop of ``mj_step`` on the same model and states.

    Args:
        env: Environment id.
        seconds: How long to measure.
        seed: Seed of environment and actions.
        **options: Options of the environment.

    Returns:
        ``steps_per_s``, ``raw_steps_per_s`` and ``ratio``, as ``bench_step``.
    """
    registration.register_all()
    single: Any = gymnasium.make(env, disable_env_checker=True, **options)
    vector: OmniVectorEnv = single.unwrapped.vector
    observation, _ = single.reset(seed=seed)
    simulation, substeps = vector.simulation, vector.config.physics.substeps
    data = mujoco.MjData(simulation.model)
    rng = np.random.default_rng(seed)

    def play() -> float:
        nonlocal observation
        elapsed = 0.0
        for _ in range(SLICE):
            action = _aim(vector, observation[None], rng)[0]
            begun = time.perf_counter()
            observation, _, terminated, truncated, _ = single.step(action)
            if terminated or truncated:
                observation, _ = single.reset()
            elapsed += time.perf_counter() - begun
        return elapsed

    def load() -> None:
        for name in _STATE:
            getattr(data, name)[:] = simulation.batch.bind(name)[0]

    def run() -> float:
        model = simulation.model
        return _timed(lambda: [mujoco.mj_step(model, data, substeps) for _ in range(SLICE)])

    return _turns(play, load, run, SLICE, seconds)


def bench_humanoid(*, seconds: float = 5.0, seed: int = 0) -> dict[str, float]:
    """Measures Gymnasium's Humanoid-v5 beside a loop of ``mj_step``, as ``bench_single``."""
    env: Any = gymnasium.make("Humanoid-v5", disable_env_checker=True)
    env.reset(seed=seed)
    inner = env.unwrapped
    model, data = inner.model, mujoco.MjData(inner.model)
    rng = np.random.default_rng(seed)

    def play() -> float:
        elapsed = 0.0
        for _ in range(SLICE):
            action = rng.uniform(-0.4, 0.4, env.action_space.shape).astype(np.float32)
            begun = time.perf_counter()
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
            elapsed += time.perf_counter() - begun
        return elapsed

    def load() -> None:
        for name in _STATE:
            getattr(data, name)[:] = getattr(inner.data, name)

    def run() -> float:
        return _timed(lambda: [mujoco.mj_step(model, data, inner.frame_skip) for _ in range(SLICE)])

    return _turns(play, load, run, SLICE, seconds)


def _turns(
    play: Callable[[], float],
    load: Callable[[], None],
    run: Callable[[], float],
    steps: int,
    seconds: float,
) -> dict[str, float]:
    """Lets environment and physics take turns; each returns its time for ``steps`` steps."""
    ours: list[float] = []
    theirs: list[float] = []
    finish = time.perf_counter() + seconds
    while time.perf_counter() < finish or len(ours) < 3:
        load()
        # Whoever goes first differs, so that neither always finds the caches warm.
        for mine in (True, False) if len(ours) % 2 else (False, True):
            (ours if mine else theirs).append(play() if mine else run())
    return {
        "steps_per_s": steps / float(np.median(ours)),
        "raw_steps_per_s": steps / float(np.median(theirs)),
        "ratio": float(np.median(np.array(theirs) / np.array(ours))),
        "slices": len(ours),
    }


def _aim(vector: OmniVectorEnv, observations: Any, rng: np.random.Generator) -> np.ndarray:
    """Actions (N, n) whose joint targets are the reference's joint positions, with noise."""
    joints = vector.robot.num_joints
    seen = observations["policy"] if isinstance(observations, dict) else observations
    noise = NOISE * rng.standard_normal((len(seen), joints))
    if vector.config.action.mode == "residual":
        return noise
    # The command comes first: joint positions, then velocities.
    offset = seen[:, :joints] - vector.robot.default_joint_array
    return noise + offset / (vector.robot.action_scale * vector.config.action.scale)


def _make(env: str, num_envs: int, num_threads: int, options: dict[str, Any]) -> OmniVectorEnv:
    registration.register_all()
    ids = [e.id for e in registration.ENVIRONMENTS]
    if env not in ids:
        raise UnknownNameError("environment", env, ids)
    made: Any = gymnasium.make_vec(env, num_envs=num_envs, num_threads=num_threads, **options)
    return made.unwrapped


def _timed(call: Callable[[], Any]) -> float:
    started = time.perf_counter()
    call()
    return time.perf_counter() - started


def _resident_bytes() -> int:
    """Memory of this process: resident where the system tells, else the peak so far."""
    try:
        with open("/proc/self/status") as status:
            return next(int(row.split()[1]) * 1024 for row in status if row.startswith("VmRSS"))
    except (OSError, StopIteration):
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
