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

QUARTILE = 0.25
"""Of many times of the same work the lower quartile counts: what else a machine does only adds."""

WARM_UP = 8
"""Control steps before the measurement."""

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
    nothing read. It makes every control step of the environment, too: same per-simulation models,
    same states, same joint targets. The two take turns step by step, so that whatever else the
    machine does hits both alike, and take turns in who is first: the second finds what the first
    has left in the processor's caches and branch predictors.

    Args:
        env: Environment id.
        num_envs: Simulations.
        num_threads: Physics threads; 0 takes every core.
        seconds: How long to measure.
        seed: Seed of environment and actions.
        **options: Options of the environment.

    Returns:
        ``steps_per_s`` and ``raw_steps_per_s`` (control steps; see ``QUARTILE``), their ``ratio``,
        and the conditions.
    """
    vector = make_vector(env, num_envs, num_threads, options)
    rng = np.random.default_rng(seed)
    observations, _ = vector.reset(seed=seed)
    for _ in range(WARM_UP):
        observations = vector.step(aim(vector, observations, rng))[0]
    live = vector.simulation.batch
    raw = Batch(vector.simulation.model, num_envs, live.nthread)
    substeps = vector.config.physics.substeps

    def pair(raw_first: bool) -> tuple[float, float, bool]:
        nonlocal observations
        action = aim(vector, observations, rng)
        vector.simulation.copy_models_to(raw)
        vector.aim(action)
        for name in _STATE:
            raw.bind(name)[:] = live.bind(name)

        def ours() -> None:
            nonlocal observations
            observations = vector.step(action)[0]

        return *_timed(ours, lambda: raw.step(nstep=substeps), raw_first), False

    figures = _measure(pair, num_envs, seconds)
    vector.close()
    return figures | {
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
    model, data = simulation.model_of(0), mujoco.MjData(simulation.model)
    rng = np.random.default_rng(seed)
    over = True

    def pair(raw_first: bool) -> tuple[float, float, bool]:
        nonlocal over
        action = aim(vector, observation[None], rng)
        if over:
            simulation.batch.get_model(0, model)
        vector.aim(action)
        for name in _STATE:
            getattr(data, name)[:] = simulation.batch.bind(name)[0]
        over = False

        def ours() -> None:
            nonlocal observation, over
            observation, _, terminated, truncated, _ = single.step(action[0])
            over = terminated or truncated
            if over:
                observation, _ = single.reset()

        times = _timed(ours, lambda: mujoco.mj_step(model, data, substeps), raw_first)
        return *times, over

    return _measure(pair, 1, seconds)


def bench_humanoid(*, seconds: float = 5.0, seed: int = 0) -> dict[str, float]:
    """Measures Gymnasium's Humanoid-v5 beside a loop of ``mj_step``, as ``bench_single``."""
    env: Any = gymnasium.make("Humanoid-v5", disable_env_checker=True)
    env.reset(seed=seed)
    inner = env.unwrapped
    model, data = inner.model, mujoco.MjData(inner.model)
    rng = np.random.default_rng(seed)

    over = False

    def pair(raw_first: bool) -> tuple[float, float, bool]:
        action = rng.uniform(-0.4, 0.4, env.action_space.shape).astype(np.float32)
        for name in _STATE:
            getattr(data, name)[:] = getattr(inner.data, name)
        data.ctrl[:] = action

        def ours() -> None:
            nonlocal over
            _, _, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
            if over:
                env.reset()

        times = _timed(ours, lambda: mujoco.mj_step(model, data, inner.frame_skip), raw_first)
        return *times, over

    return _measure(pair, 1, seconds)


def _timed(
    ours: Callable[[], None], raw: Callable[[], None], raw_first: bool
) -> tuple[float, float]:
    """Returns how long both take, s, ours first; ``raw_first`` is the order that they run in."""
    times = []
    for run in (raw, ours) if raw_first else (ours, raw):
        started = time.perf_counter()
        run()
        times.append(time.perf_counter() - started)
    return (times[1], times[0]) if raw_first else (times[0], times[1])


def _measure(
    pair: Callable[[bool], tuple[float, float, bool]], steps: int, seconds: float
) -> dict[str, float]:
    """Repeats pairs of ``steps`` control steps, by the environment and by raw physics.

    Pairs in which the environment has started an episode, if that is told apart, are measured on
    their own and weigh by their share.
    """
    rows: list[tuple[float, float, bool]] = []
    finish = time.perf_counter() + seconds
    while time.perf_counter() < finish or len(rows) < 3:
        rows.append(pair(len(rows) % 2 == 1))
    times, started = np.array([row[:2] for row in rows]), np.array([row[2] for row in rows])
    ours, raw = sum(
        np.quantile(times[which], QUARTILE, axis=0) * which.mean()
        for which in (started, ~started)
        if which.any()
    )
    return {
        "steps_per_s": steps / float(ours),
        "raw_steps_per_s": steps / float(raw),
        "ratio": float(raw / ours),
        "measurements": len(rows),
    }


def aim(vector: OmniVectorEnv, observations: Any, rng: np.random.Generator) -> np.ndarray:
    """Returns actions (N, n) that aim at the reference's joint positions, with noise."""
    joints = vector.robot.num_joints
    seen = observations["policy"] if isinstance(observations, dict) else observations
    noise = NOISE * rng.standard_normal((len(seen), joints))
    if vector.config.action.mode != "default":
        return noise
    # The command comes first: joint positions, then velocities.
    offset = seen[:, :joints] - vector.robot.default_joint_array
    return noise + offset / (vector.robot.action_scale * vector.config.action.scale)


def make_vector(
    env: str, num_envs: int, num_threads: int, options: dict[str, Any]
) -> OmniVectorEnv:
    """Makes a vector environment of this package.

    Raises:
        UnknownNameError: The id is of another.
    """
    registration.register_all()
    ids = [e.id for e in registration.ENVIRONMENTS]
    if env not in ids:
        raise UnknownNameError("environment", env, ids)
    made: Any = gymnasium.make_vec(env, num_envs=num_envs, num_threads=num_threads, **options)
    return made.unwrapped
