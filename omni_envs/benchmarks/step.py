"""Speed of stepping: an environment beside the physics it runs on, in the same run."""

from __future__ import annotations

import time
from typing import Any

import gymnasium
import mujoco
import numpy as np
from mujoco.batch import Batch

import omni_envs
from omni_envs import registration
from omni_envs.envs import OmniVectorEnv
from omni_envs.errors import InvalidOptionError, UnknownNameError

SLICE = 8
"""Control steps per timed slice; environment and physics take turns."""

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

    Raw physics is ``mujoco.batch``: ``step(nstep=substeps)`` with constant controls, nothing read,
    on the same per-simulation models and started from the environment's states before every slice.
    Slices of both take turns, so that whatever else the machine does hits both alike.

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
    actions = 0.3 * rng.standard_normal((SLICE, num_envs, vector.robot.num_joints)).astype(
        np.float32
    )
    vector.reset(seed=seed)
    for action in actions:
        vector.step(action)
    memory = (_resident_bytes() - base) / num_envs
    live = vector.simulation.batch
    raw = Batch(vector.simulation.model, num_envs, live.nthread)
    vector.simulation.copy_models_to(raw)
    substeps = vector.config.physics.substeps
    ours: list[float] = []
    theirs: list[float] = []
    finish = time.perf_counter() + seconds
    while time.perf_counter() < finish or len(ours) < 3:
        for name in _STATE:
            raw.bind(name)[:] = live.bind(name)
        ours.append(_timed(lambda: [vector.step(action) for action in actions]))
        theirs.append(_timed(lambda: [raw.step(nstep=substeps) for _ in actions]))
    vector.close()
    steps = SLICE * num_envs
    return {
        "steps_per_s": steps / float(np.median(ours)),
        "raw_steps_per_s": steps / float(np.median(theirs)),
        "ratio": float(np.median(np.array(theirs) / np.array(ours))),
        "bytes_per_env": round(memory),
        "construct_seconds": construct,
        "num_envs": num_envs,
        "num_threads": live.nthread,
        "slices": len(ours),
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
    single.reset(seed=seed)
    simulation = vector.simulation
    data, substeps = mujoco.MjData(simulation.model), vector.config.physics.substeps
    rng = np.random.default_rng(seed)
    actions = 0.3 * rng.standard_normal((SLICE, *single.action_space.shape)).astype(np.float32)

    def play() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = single.step(action)
            if terminated or truncated:
                single.reset()

    return _turns(play, lambda: _load(simulation, data), data, simulation.model, substeps, seconds)


def bench_humanoid(*, seconds: float = 5.0, seed: int = 0) -> dict[str, float]:
    """Measures Gymnasium's Humanoid-v5 beside a loop of ``mj_step``, as ``bench_single``."""
    env: Any = gymnasium.make("Humanoid-v5", disable_env_checker=True)
    env.reset(seed=seed)
    inner = env.unwrapped
    model, data = inner.model, mujoco.MjData(inner.model)
    rng = np.random.default_rng(seed)
    actions = rng.uniform(-0.4, 0.4, (SLICE, *env.action_space.shape)).astype(np.float32)

    def play() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    def load() -> None:
        for name in _STATE:
            getattr(data, name)[:] = getattr(inner.data, name)

    return _turns(play, load, data, model, inner.frame_skip, seconds)


def _turns(
    play: Any, load: Any, data: mujoco.MjData, model: mujoco.MjModel, substeps: int, seconds: float
) -> dict[str, float]:
    ours: list[float] = []
    theirs: list[float] = []
    finish = time.perf_counter() + seconds
    while time.perf_counter() < finish or len(ours) < 3:
        load()
        ours.append(_timed(play))
        theirs.append(_timed(lambda: mujoco.mj_step(model, data, SLICE * substeps)))
    return {
        "steps_per_s": SLICE / float(np.median(ours)),
        "raw_steps_per_s": SLICE / float(np.median(theirs)),
        "ratio": float(np.median(np.array(theirs) / np.array(ours))),
    }


def _load(simulation: Any, data: mujoco.MjData) -> None:
    for name in _STATE:
        getattr(data, name)[:] = simulation.batch.bind(name)[0]


def _make(env: str, num_envs: int, num_threads: int, options: dict[str, Any]) -> OmniVectorEnv:
    registration.register_all()
    if env not in gymnasium.registry:
        raise UnknownNameError("environment", env, [e.id for e in registration.ENVIRONMENTS])
    made = gymnasium.make_vec(env, num_envs=num_envs, num_threads=num_threads, **options)
    vector = made.unwrapped
    if not isinstance(vector, OmniVectorEnv):
        raise InvalidOptionError(f"bench step measures environments of this package; got {env!r}.")
    return vector


def _timed(call: Any) -> float:
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
