"""How good a policy is: success from motion start to end, and short windows all over the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from gymnasium.vector import VectorEnv

from omni_envs.progress import ProgressCallback
from omni_envs.training.config import TrainConfig, merged
from omni_envs.training.environment import make_env
from omni_envs.training.evaluation import Evaluation, MotionEvaluation
from omni_envs.training.rollout import Episodes, Policy, play
from omni_envs.training.statistics import wilson_interval

WINDOW_SECONDS, WINDOWS = 3.0, 64
CARRIED = 0.5
"""Distance within which an object counts as carried, m. One that is left on the ground is further
away as soon as the reference has it in its arms; the task's own criterion of 1 m is not."""
EVALUATION_MODELS = 1
"""Seed of the randomized models of an evaluation (``RandomizationConfig.seed``): training has 0."""
UNCLIPPED = 1e3
"""Action limit of environments that a policy file acts in: clipping is part of the file."""


def evaluation_options(
    options: Mapping[str, Any], *, randomized: bool = True, file: bool = False
) -> dict[str, Any]:
    """Returns the options of the environment that a policy for ``options`` is evaluated in.

    Episodes start at the motion's first frame and last to its end, the object counts from the
    first step, physics are the default ones. Randomized models are drawn anew: none is one that
    the policy was trained on.

    Args:
        options: Options of the task (``TrainConfig.env_options``).
        randomized: With the randomization, the noise and the pushes of the task, or without any.
        file: For a policy file, whose actions are standard ones whatever it was trained as.
    """
    changes: dict[str, Any] = {
        "physics": "default",
        "reset": {"start": "start"},
        "observation": {},
        "termination": {"max_seconds": None, "object_after": 0.0},
        "randomization": {"seed": EVALUATION_MODELS},
    }
    if not randomized:
        changes["reset"]["noise"] = changes["observation"]["noise"] = None
        changes["randomization"] = {
            "torso_centre_of_mass": None,
            "joint_default": 0.0,
            "friction": None,
            "push": None,
            "object": None,
        }
    if file:
        changes["action"] = {"mode": "default", "limit": UNCLIPPED}
    return merged(options, changes)


def make_evaluation_env(config: TrainConfig, num_envs: int, **kind: bool) -> VectorEnv:
    """Makes the environment that policies of a run are evaluated in; see ``evaluation_options``."""
    return make_env(config, num_envs, evaluation_options(config.env_options, **kind))


def play_windows(
    env: VectorEnv, policy: Policy, frames: Sequence[int], seconds: float = WINDOW_SECONDS
) -> tuple[Episodes, float]:
    """Plays one window per simulation, start frames spread evenly over the motions.

    Args:
        env: Environment of the motions, best without randomization.
        policy: Who acts.
        frames: Frames of each motion.
        seconds: Length of a window; a shorter motion is one window.

    Returns:
        The windows as episodes, and their length in s.
    """
    dt = env.unwrapped.control_step  # type: ignore[attr-defined]
    steps = min(round(seconds / dt), min(frames) - 1)
    motion, start = _turns(env.num_envs, len(frames)), np.zeros(env.num_envs, int)
    for m, length in enumerate(frames):
        mine = motion == m
        start[mine] = np.linspace(0, length - 1 - steps, mine.sum()).round().astype(int)
    options = {"motion": motion, "frame": start}
    return play(env, policy, seed=0, options=options, max_steps=steps), steps * dt


def evaluate(
    config: TrainConfig,
    policy: Policy,
    *,
    file: bool = False,
    steps: int = 0,
    seconds: float = 0.0,
    seed: int = 1_000_003,
    progress: ProgressCallback | None = None,
) -> Evaluation:
    """Evaluates a policy without exploration.

    Args:
        config: The run that it belongs to.
        policy: Who acts.
        file: Whether it is a policy file (``OnnxPolicy``) instead of the network.
        steps: Control steps that it was trained for, for the record.
        seconds: Training time, for the record.
        seed: Seed of the episodes.
        progress: Called with the number of finished episodes and of all.
    """
    env = make_evaluation_env(config, config.evaluation_episodes, file=file)
    try:
        frames = [r.num_frames for r in env.unwrapped.references]  # type: ignore[attr-defined]
        turns = _turns(env.num_envs, len(frames))
        whole = play(env, policy, seed=seed, options={"motion": turns}, progress=progress)
    finally:
        env.close()
    env = make_evaluation_env(config, WINDOWS, randomized=False, file=file)
    try:
        windows, window_seconds = play_windows(env, policy, frames)
        dt = env.unwrapped.control_step  # type: ignore[attr-defined]
    finally:
        env.close()
    rate, interval = _success(whole, np.ones(len(turns), bool))
    return Evaluation(
        success_rate=rate,
        success_ci95=interval,
        carried_rate=_carried(whole),
        episodes=len(whole.lengths),
        episode_length_mean=float(whole.lengths.mean()),
        episode_length_possible=max(frames) - 1,
        return_mean=float(whole.returns.mean()),
        body_error_mean_m=_weighted(whole),
        window_survival_rate=float((~windows.terminated).mean()),
        window_seconds_mean=float(windows.lengths.mean() * dt),
        window_body_error_mean_m=_weighted(windows),
        windows=len(windows.lengths),
        window_seconds=window_seconds,
        steps=steps,
        seconds=seconds,
        motions=_by_motion(whole, turns, frames) if len(frames) > 1 else (),
    )


def _turns(episodes: int, motions: int) -> np.ndarray:
    """Returns the (episodes,) motions that take turns."""
    return np.arange(episodes) % motions


def _success(episodes: Episodes, mine: np.ndarray) -> tuple[float, tuple[float, float]]:
    """Returns the success rate of some episodes (N,) and its interval."""
    count, successes = int(mine.sum()), int((~episodes.terminated & mine).sum())
    return successes / count, wilson_interval(successes, count)


def _by_motion(
    episodes: Episodes, turns: np.ndarray, frames: Sequence[int]
) -> tuple[MotionEvaluation, ...]:
    return tuple(
        MotionEvaluation(
            m,
            int((turns == m).sum()),
            *_success(episodes, turns == m),
            float(episodes.lengths[turns == m].mean()),
            length - 1,
        )
        for m, length in enumerate(frames)
        if (turns == m).any()
    )


def _carried(episodes: Episodes) -> float | None:
    if episodes.object_error is None:
        return None
    return float((~episodes.terminated & (episodes.object_error <= CARRIED)).mean())


def _weighted(episodes: Episodes) -> float:
    """Mean error over all control steps."""
    return float((episodes.body_error * episodes.lengths).sum() / episodes.lengths.sum())


def evaluate_run(
    run: str | Path,
    *,
    which: Literal["first", "last"] = "last",
    file: str | Path | None = None,
    episodes: int | None = None,
    progress: ProgressCallback | None = None,
) -> Evaluation:
    """Evaluates the policy of a run directory.

    Args:
        run: Run directory.
        which: ``"last"`` checkpoint or ``"first"``, the untrained policy.
        file: A policy file to evaluate instead, e.g. ``RUN/policy.onnx``.
        episodes: Number of episodes, by default that of the run's configuration.
        progress: Called with the number of finished episodes and of all.

    Raises:
        FileFormatError: Configuration, checkpoint or policy file is missing or damaged.
    """
    from omni_envs.training.checkpoint import Checkpoint
    from omni_envs.training.network_policy import NetworkPolicy, find_checkpoint, load_actor
    from omni_envs.training.onnx_policy import OnnxPolicy

    config = TrainConfig.load(run)
    if episodes is not None:
        config = replace(config, evaluation_episodes=episodes)
    path = find_checkpoint(run, which)
    state = Checkpoint.load(path)
    policy: Policy = NetworkPolicy(load_actor(path)) if file is None else OnnxPolicy(file)
    return evaluate(
        config,
        policy,
        file=file is not None,
        steps=state.steps,
        seconds=state.seconds,
        progress=progress,
    )
