"""The training run: config in, run directory out."""

from __future__ import annotations

import sys
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gymnasium.vector import VectorEnv

from omni_envs.errors import InvalidOptionError, MissingDependencyError

try:
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
    from stable_baselines3.common.vec_env import VecMonitor
except ImportError as error:
    raise MissingDependencyError("stable-baselines3", "sb3", "Training with SB3") from error

from omni_envs.training.checkpoint import Checkpoint, checkpoints, keep_newest
from omni_envs.training.config import TrainConfig, merged
from omni_envs.training.curve import write_history
from omni_envs.training.display import TrainingDisplay
from omni_envs.training.environment import make_env
from omni_envs.training.ppo import TrackingPPO
from omni_envs.training.rollout import BODY_ERROR
from omni_envs.training.sb3_vec_env import SB3VecEnv

KEEP_CHECKPOINTS = 3


@dataclass(frozen=True)
class RunResult:
    """What training left behind.

    Attributes:
        out: Run directory.
        steps: Control steps trained for.
        seconds: Training time.
        control_dt: Seconds per control step.
        history: One row per update: ``steps``, ``seconds``, ``steps_per_s``, ``episode_length``
            (control steps), ``episode_return``, ``body_error_m`` and the figures of the update.
    """

    out: Path
    steps: int
    seconds: float
    control_dt: float
    history: tuple[dict[str, float], ...]


def train(
    config: TrainConfig,
    *,
    resume: bool = False,
    progress: bool | None = None,
    env: VectorEnv | None = None,
) -> RunResult:
    """Trains a policy; the run directory can be evaluated and exported afterwards.

    Args:
        config: What to train, and where to put it.
        resume: Go on from the last checkpoint in ``config.out``.
        progress: Show progress on stderr; by default where stderr is a terminal.
        env: Vector environment to train in, instead of making ``config.env``; it is not closed.

    Returns:
        Where it is and how it went.

    Raises:
        InvalidOptionError: The run directory is in use, there is nothing to resume, or there is no
            such environment.
        FileFormatError: The checkpoint to resume from is damaged.
        OmniEnvsError: Training diverged.
    """
    found = checkpoints(config.out)
    if found and not resume:
        raise InvalidOptionError(
            f"{config.out} already holds a training run: resume it, or choose another directory."
        )
    if resume and not found:
        raise InvalidOptionError(f"{config.out} holds no checkpoint to resume from.")
    options = merged(config.env_options, config.training_options)
    made = env or make_env(config, config.num_envs, options)
    try:
        return _train(config, made, found[-1] if found else None, progress)
    finally:
        if env is None:
            made.close()


def _train(
    config: TrainConfig, env: VectorEnv, start: Path | None, progress: bool | None
) -> RunResult:
    adapter = SB3VecEnv(env)
    learner = TrackingPPO(VecMonitor(adapter), config.ppo, seed=config.seed)
    learner.set_logger(Logger(None, [TensorBoardOutputFormat(str(config.out / "tensorboard"))]))
    errors = _TrackingError(adapter)
    config.save()
    state = Checkpoint.load(start) if start else _checkpoint(learner, 0.0, [])
    if start:
        _restore(learner, state, config.seed)
    else:
        state.save(config.out)
    history, before, begin = state.history, state.seconds, time.perf_counter()
    seconds, saved = before, learner.num_timesteps
    control_dt = float(getattr(env.unwrapped, "control_step", 1.0))
    show = sys.stderr.isatty() if progress is None else progress
    with TrainingDisplay(config.steps, config.time_limit, control_dt, show) as display:
        while learner.num_timesteps < config.steps and not 0 < config.time_limit <= seconds:
            last, done = seconds, learner.num_timesteps
            learner.learn(1, callback=errors, log_interval=None, reset_num_timesteps=False)
            seconds = before + time.perf_counter() - begin
            history.append(_row(learner, errors, seconds, learner.num_timesteps - done, last))
            display.update(history[-1])
            _log(learner, history[-1])
            if len(history) % config.checkpoint_every == 0:
                saved = _save(config.out, learner, seconds, history)
    if saved != learner.num_timesteps:
        _save(config.out, learner, seconds, history)
    return RunResult(config.out, learner.num_timesteps, seconds, control_dt, tuple(history))


class _TrackingError(BaseCallback):
    """Mean tracking error over the steps of a rollout."""

    def __init__(self, env: SB3VecEnv) -> None:
        super().__init__()
        self._env = env
        self.mean = float("nan")
        self._values: list[float] = []

    def _on_step(self) -> bool:
        value = self._env.batched_infos.get(BODY_ERROR)
        if value is not None:
            self._values.append(float(np.mean(value)))
        return True

    def _on_rollout_end(self) -> None:
        self.mean = float(np.mean(self._values)) if self._values else float("nan")
        self._values.clear()


def _row(
    learner: TrackingPPO, errors: _TrackingError, seconds: float, steps: int, last: float
) -> dict[str, float]:
    episodes = learner.ep_info_buffer or ()

    def mean(key: str) -> float:
        return float(np.mean([e[key] for e in episodes])) if episodes else float("nan")

    return {
        "steps": float(learner.num_timesteps),
        "seconds": seconds,
        "steps_per_s": steps / (seconds - last),
        "episode_length": mean("l"),
        "episode_return": mean("r"),
        "body_error_m": errors.mean,
        **learner.figures,
    }


def _log(learner: TrackingPPO, row: dict[str, float]) -> None:
    for name, value in row.items():
        if name != "steps":
            learner.logger.record(f"training/{name}", value)
    learner.logger.dump(learner.num_timesteps)


def _checkpoint(
    learner: TrackingPPO, seconds: float, history: list[dict[str, float]]
) -> Checkpoint:
    return Checkpoint(
        steps=learner.num_timesteps,
        seconds=seconds,
        updates=learner._n_updates,
        learning_rate=learner.current_learning_rate,
        policy=learner.policy.state_dict(),
        optimizer=learner.policy.optimizer.state_dict(),
        rng=torch.get_rng_state(),
        history=history,
        episodes=[(float(e["r"]), float(e["l"])) for e in learner.ep_info_buffer or ()],
    )


def _save(run: Path, learner: TrackingPPO, seconds: float, history: list[dict[str, float]]) -> int:
    _checkpoint(learner, seconds, history).save(run)
    keep_newest(run, KEEP_CHECKPOINTS)
    write_history(run, history)
    return learner.num_timesteps


def _restore(learner: TrackingPPO, state: Checkpoint, seed: int) -> None:
    learner.policy.load_state_dict(state.policy)
    learner.policy.optimizer.load_state_dict(state.optimizer)
    learner.num_timesteps, learner._n_updates = state.steps, state.updates
    learner.current_learning_rate = state.learning_rate
    window = learner._stats_window_size
    learner.ep_info_buffer = deque(({"r": r, "l": n} for r, n in state.episodes), maxlen=window)
    learner.ep_success_buffer = deque(maxlen=window)
    # The simulations start anew: episodes under way at the checkpoint are not part of it.
    learner.env.seed((seed + state.steps) % 2**31)
    torch.set_rng_state(state.rng)
