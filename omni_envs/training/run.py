"""The training run: config in, run directory out."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gymnasium.vector import VectorEnv

from omni_envs.errors import InvalidOptionError, MissingDependencyError

try:
    from torch.utils.tensorboard import SummaryWriter
except ImportError as error:
    raise MissingDependencyError("tensorboard", "sb3", "Training") from error

from omni_envs.training.averaging import WeightAverage
from omni_envs.training.checkpoint import Checkpoint, checkpoints, keep_newest
from omni_envs.training.config import TrainConfig, merged
from omni_envs.training.curve import write_history
from omni_envs.training.device import machine, torch_device
from omni_envs.training.display import TrainingDisplay
from omni_envs.training.environment import make_env
from omni_envs.training.fine_tuning import with_networks_of
from omni_envs.training.learner import History, Learner, autoreset_mode, make_learner
from omni_envs.training.network_policy import find_checkpoint
from omni_envs.training.stretches import check_changes, lengthened, set_exploration

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
            (control steps), ``episode_return``, ``body_error_m``, ``object_error_m`` where there
            is an object, and the figures of the update.
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
        env: Vector environment to train in, instead of making ``config.env``, in the autoreset
            mode of the trainer; it is not closed.

    Returns:
        Where it is and how it went.

    Raises:
        InvalidOptionError: The run directory is in use, there is nothing to resume, or there is no
            such environment or device.
        FileFormatError: The checkpoint to resume from is damaged.
        MissingDependencyError: The trainer is not installed.
        OmniEnvsError: Training diverged.
    """
    found = checkpoints(config.out)
    if found and not resume:
        raise InvalidOptionError(
            f"{config.out} already holds a training run: resume it, or choose another directory."
        )
    if resume and not found:
        raise InvalidOptionError(f"{config.out} holds no checkpoint to resume from.")
    # Both fail before the environment is made.
    torch_device(config.device)
    if config.start_from and not found:
        find_checkpoint(config.start_from)
    options = merged(config.env_options, config.training_options)
    mode = {"autoreset_mode": autoreset_mode(config).name}
    made = env or make_env(config, config.num_envs, {**options, **mode})
    try:
        learner = make_learner(config, made)
        try:
            dt = float(getattr(made.unwrapped, "control_step", 1.0))
            return _train(config, learner, dt, found[-1] if found else None, progress)
        finally:
            learner.close()
    finally:
        if env is None:
            made.close()


def _train(
    config: TrainConfig,
    learner: Learner,
    control_dt: float,
    start: Path | None,
    progress: bool | None,
) -> RunResult:
    state = Checkpoint.load(start) if start else learner.state(0.0, [])
    if config.start_from and not start:
        state = with_networks_of(config.start_from, state, config.ppo.initial_std)
    if not state.optimizer:
        raise InvalidOptionError(
            f"{config.out} holds a published policy, without what a training needs to go on: "
            "start a run of its own from it (start_from)."
        )
    if start:
        check_changes(TrainConfig.load(config.out), config)
        set_exploration(state, config)
    config.save()
    if start or config.start_from:
        learner.restore(state)
    if not start:
        state.save(config.out)
    history, before, begin = state.history, state.seconds, time.perf_counter()
    here = machine(torch_device(config.device), config.num_threads)
    lineage: dict[str, Any] = {
        "stretches": lengthened(state.stretches, config, learner.steps, here),
        "ancestors": state.ancestors,
    }
    over = config.ppo.average_updates
    average = WeightAverage(over, state.average) if over else None
    seconds, saved = before, learner.steps
    show = sys.stderr.isatty() if progress is None else progress
    with (
        SummaryWriter(str(config.out / "tensorboard")) as board,
        TrainingDisplay(config.steps, config.time_limit, control_dt, show) as display,
    ):
        while learner.steps < config.steps and not 0 < config.time_limit <= seconds:
            last, done = seconds, learner.steps
            figures = learner.learn()
            seconds = before + time.perf_counter() - begin
            row = {
                "steps": float(learner.steps),
                "seconds": seconds,
                "steps_per_s": (learner.steps - done) / (seconds - last),
                **figures,
            }
            history.append(row)
            if average:
                average.update(learner.weights)
            display.update(row)
            for name, value in row.items():
                if name != "steps":
                    board.add_scalar(f"training/{name}", value, learner.steps)
            if len(history) % config.checkpoint_every == 0:
                saved = _save(config.out, learner, seconds, history, lineage, average)
    if saved != learner.steps:
        _save(config.out, learner, seconds, history, lineage, average)
    return RunResult(config.out, learner.steps, seconds, control_dt, tuple(history))


def _save(
    run: Path,
    learner: Learner,
    seconds: float,
    history: History,
    lineage: dict[str, Any],
    average: WeightAverage | None,
) -> int:
    state = learner.state(seconds, history)
    replace(state, **lineage, average=average.state if average else None).save(run)
    keep_newest(run, KEEP_CHECKPOINTS)
    write_history(run, history)
    return learner.steps
