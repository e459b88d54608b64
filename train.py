"""Train a policy, evaluate it, export it: ``python train.py --env ID --steps N --out RUN``."""

from __future__ import annotations

import importlib.util
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import tyro
from rich.console import Console
from rich.table import Table

from omni_envs.errors import InvalidOptionError, MissingDependencyError, OmniEnvsError
from omni_envs.progress import progress_bar
from omni_envs.training.config import TrainConfig, merged
from omni_envs.training.recipes import RECIPES

PACKAGES = {"sb3": ("stable_baselines3", "SB3"), "torchrl": ("torchrl", "TorchRL")}
"""Trainer, which is its extra too, to package and title."""


@dataclass
class Arguments:
    """Train a policy, evaluate it, export it."""

    steps: int
    """Control steps to train for, all simulations together."""

    out: Path
    """Run directory."""

    env: str = "OmniEnvs/G1BoxCarry-v0"
    """Environment id."""

    trainer: Literal["sb3", "torchrl"] = "sb3"
    """Library that trains."""

    recipe: Literal["small", "quick", "published"] = "small"
    """Settings to start from."""

    num_envs: int = 0
    """Simulations; 0 takes the recipe's."""

    num_threads: int | None = None
    """Physics threads; 0 takes every core. By default every core, or those of the run to resume."""

    seed: int = 0
    """Seed of network, exploration and environment."""

    device: Literal["auto", "cpu", "cuda"] | None = None
    """Where the network learns; auto takes a GPU where there is one. By default the CPU, or the
    device of the run to resume. Physics is on the CPU."""

    resume: bool = False
    """Go on from the last checkpoint in the run directory, with the settings saved there, but for
    what --ppo, --training-options, --num-envs, --num-threads and --device change."""

    start_from: str = ""
    """Run directory or published policy whose networks the new run begins with: fine-tuning."""

    time_limit: float = 0.0
    """Seconds of training, earlier parts included, after which it ends anyway; 0 = no limit."""

    episodes: int = 100
    """Episodes of the evaluation."""

    env_options: str = "{}"
    """Options of the task as JSON, over those of the recipe."""

    training_options: str = "{}"
    """Options in training alone as JSON, over those of the recipe."""

    ppo: str = "{}"
    """Hyper-parameters as JSON, over those of the recipe."""

    json: bool = False
    """Print JSON."""


def make_config(arguments: Arguments) -> TrainConfig:
    """Builds the configuration of a new run, or changes that of the run to resume."""
    ends: dict[str, Any] = {
        "steps": arguments.steps,
        "time_limit": arguments.time_limit,
        "evaluation_episodes": arguments.episodes,
    }
    if arguments.device is not None:
        ends["device"] = arguments.device
    if arguments.resume:
        config = TrainConfig.load(arguments.out)
        if config.env != arguments.env:
            raise InvalidOptionError(
                f"{arguments.out} is a run on {config.env}: --env must say so."
            )
        if arguments.start_from:
            raise InvalidOptionError(
                "--start-from: a run that goes on has networks already; give a new --out."
            )
        return _going_on(arguments, replace(config, **ends))
    return RECIPES[arguments.recipe].config(
        arguments.env,
        arguments.out,
        num_envs=arguments.num_envs or None,
        env_options=_mapping("--env-options", arguments.env_options),
        training_options=_mapping("--training-options", arguments.training_options),
        ppo=_mapping("--ppo", arguments.ppo),
        trainer=arguments.trainer,
        num_threads=arguments.num_threads or 0,
        seed=arguments.seed,
        start_from=arguments.start_from,
        **ends,
    )


def _going_on(arguments: Arguments, config: TrainConfig) -> TrainConfig:
    """Lays the options that were given over the settings that a run was saved with."""
    if arguments.env_options != "{}":
        raise InvalidOptionError("--env-options: the task of a run that goes on cannot change.")
    data, threads = config.to_dict(), arguments.num_threads
    options = _mapping("--training-options", arguments.training_options)
    return TrainConfig.from_dict(
        {
            **data,
            "num_envs": arguments.num_envs or config.num_envs,
            "num_threads": config.num_threads if threads is None else threads,
            "training_options": merged(config.training_options, options),
            "ppo": data["ppo"] | _mapping("--ppo", arguments.ppo),
        }
    )


def run(arguments: Arguments) -> dict[str, Any]:
    """Trains, evaluates and exports; returns the figures."""
    config = make_config(arguments)
    _check_packages(config.trainer)
    from omni_envs.export import export_run
    from omni_envs.training.curve import plot_curve
    from omni_envs.training.evaluate import evaluate_run
    from omni_envs.training.run import train

    result = train(config, resume=arguments.resume, progress=not arguments.json)
    plot_curve(config.out, result.history, result.control_dt)
    with progress_bar("Evaluating", unit="episodes", disable=arguments.json) as progress:
        evaluation = evaluate_run(config.out, progress=progress)
    evaluation.save(config.out)
    if evaluation.motions:
        note = "a policy file holds one motion: none was written for these"
        print(f"train.py: {note} {len(evaluation.motions)}", file=sys.stderr)
    exported = {} if evaluation.motions else export_run(config.out)
    return {**evaluation.figures(), **exported, "out": str(config.out)}


def _mapping(flag: str, text: str) -> dict[str, Any]:
    try:
        data = json.loads(text)
    except ValueError as error:
        raise InvalidOptionError(f"{flag}: expected JSON; got {text!r} ({error}).") from error
    if not isinstance(data, dict):
        raise InvalidOptionError(f"{flag}: expected a JSON object; got {text!r}.")
    return data


def _check_packages(trainer: str) -> None:
    """Fails before the training, not after it."""
    library, title = PACKAGES[trainer]
    for package, extra, purpose in (
        (library, trainer, f"Training with {title}"),
        ("tensorboard", trainer, "The TensorBoard log"),
        ("onnx", "export", "Exporting a policy"),
        ("onnxruntime", "export", "Checking an exported policy"),
        ("matplotlib", "viewer", "Drawing the learning curve"),
    ):
        if importlib.util.find_spec(package) is None:
            raise MissingDependencyError(package, extra, purpose)


def main(words: list[str] | None = None) -> int:
    """Runs the command; returns 0 done, 1 could not do what was asked (2: wrong usage)."""
    arguments = tyro.cli(Arguments, prog="train.py", args=words)
    try:
        figures = run(arguments)
    except OmniEnvsError as error:
        print(f"train.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("train.py: interrupted; --resume goes on from the last checkpoint", file=sys.stderr)
        return 1
    if arguments.json:
        print(json.dumps(figures, allow_nan=False))
        return 0
    table = Table(title=f"{arguments.out}", title_justify="left")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for name, value in figures.items():
        table.add_row(name, f"{value:.4g}" if isinstance(value, float) else str(value))
    Console().print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
