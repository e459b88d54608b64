"""Many steps under actions that no policy should give: does anything break, does memory grow?"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from rich.progress import Progress

from omni_envs.benchmarks.memory import resident_bytes
from omni_envs.benchmarks.step import make_vector
from omni_envs.errors import InvalidOptionError

KINDS = ("noise", "extremes", "flips", "huge", "nan")
"""How a simulation is driven: Gaussian noise; corners of the action space, each held for a while;
corners that change sign every step; far beyond the limits; now and then NaN or infinite."""

SETTLE = 200
"""Control steps after which memory is first read."""


def bench_soak(
    env: str = "OmniEnvs/G1BoxCarry-v0",
    steps: int = 10_000_000,
    *,
    num_envs: int = 256,
    num_threads: int = 0,
    seed: int = 0,
    progress: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Drives an environment with random and adversarial actions and looks at all that it returns.

    Args:
        env: Environment id.
        steps: Physics steps of all simulations together, at least.
        num_envs: Simulations; the kinds of actions take turns among them.
        num_threads: Physics threads; 0 takes every core.
        seed: Seed of environment and actions.
        progress: Show a bar.
        **options: Options of the environment.

    Returns:
        What was done; ``not_finite``: numbers in observations, rewards or infos that are NaN or
        infinite; ``diverged`` episodes, those of bad actions also apart; ``resident_mb_start``
        (after ``SETTLE`` steps) and ``resident_mb_end``.
    """
    if steps < 1:
        raise InvalidOptionError(f"steps must be positive; got {steps}.")
    vector = make_vector(env, num_envs, num_threads, options)
    rng = np.random.default_rng(seed)
    kind = np.arange(num_envs) % len(KINDS)
    vector.reset(seed=seed)
    substeps = vector.config.physics.substeps
    rounds = -(-steps // (num_envs * substeps))
    held = np.zeros((num_envs, vector.robot.num_joints))
    counts = dict.fromkeys(("episodes", "not_finite", "diverged", "diverged_bad_action"), 0)
    start_memory = resident_bytes()
    started = time.perf_counter()
    with Progress(disable=not progress) as bar:
        task = bar.add_task("soak", total=rounds)
        for t in range(rounds):
            actions, bad = _actions(rng, kind, held, t, vector.config.action.limit)
            observations, reward, terminated, truncated, infos = vector.step(actions)
            parts = observations.values() if isinstance(observations, dict) else [observations]
            figures = [v for k, v in infos.items() if k.startswith(("reward/", "error/"))]
            last = infos.get("final_obs")
            finals = [] if last is None else [f for o in last if o is not None for f in _arrays(o)]
            for values in (*parts, reward, *figures, *finals):
                counts["not_finite"] += int(values.size - np.isfinite(values).sum())
            counts["episodes"] += int((terminated | truncated).sum())
            counts["diverged"] += int(infos["diverged"].sum())
            counts["diverged_bad_action"] += int((infos["diverged"] & bad).sum())
            if t == min(SETTLE, rounds - 1):
                start_memory = resident_bytes()
            bar.update(task, advance=1)
    seconds = time.perf_counter() - started
    vector.close()
    megabyte = 1024.0**2
    end_memory = resident_bytes()
    return {
        "physics_steps": rounds * num_envs * substeps,
        "control_steps": rounds * num_envs,
        "num_envs": num_envs,
        **counts,
        "resident_mb_start": None if start_memory is None else start_memory / megabyte,
        "resident_mb_end": None if end_memory is None else end_memory / megabyte,
        "seconds": seconds,
    }


def _arrays(observation: Any) -> list[np.ndarray]:
    return list(observation.values()) if isinstance(observation, dict) else [observation]


def _actions(
    rng: np.random.Generator, kind: np.ndarray, held: np.ndarray, t: int, limit: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (N, n) actions and (N,) whether they are NaN or infinite; ``held`` is kept."""
    corners = limit * rng.choice([-1.0, 1.0], held.shape)
    new = rng.random(len(held)) < 0.1
    held[new] = corners[new]
    actions = rng.normal(size=held.shape)
    actions[kind == 1] = held[kind == 1]
    actions[kind == 2] = held[kind == 2] * (-1.0) ** t
    actions[kind == 3] = 1e30 * corners[kind == 3]
    bad = (kind == 4) & (rng.random(len(held)) < 0.02)
    joint = rng.integers(held.shape[1], size=len(held))
    poison = rng.choice([np.nan, np.inf, -np.inf], len(held))
    actions[bad, joint[bad]] = poison[bad]
    return actions, bad
