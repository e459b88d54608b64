"""A finished run → a folder to publish: weights, policy file, figures, pictures and a card."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from omni_envs.errors import InvalidOptionError
from omni_envs.progress import ProgressCallback

if TYPE_CHECKING:
    from omni_envs.references import Reference
    from omni_envs.training.checkpoint import Checkpoint
    from omni_envs.training.config import TrainConfig
    from omni_envs.training.evaluate import Evaluation

EPISODES = 200
CARD, STRIP, MOTION = "README.md", "rollout.png", "reference.npz"
PICTURES, COLUMNS = 12, 6


def publish(
    run: str | Path,
    out: str | Path,
    *,
    episodes: int = EPISODES,
    least: float = 0.0,
    progress: ProgressCallback | None = None,
) -> dict[str, Any]:
    """Evaluates and exports a run and puts together what belongs to a published policy.

    The folder is a run directory itself, so that it can be evaluated and exported again; of the
    training it keeps the weights, the curve and the motion: what a later version of the package
    makes of the demonstration would be another one.

    Args:
        run: Run directory.
        out: Folder to make or to replace the contents of; its name becomes the policy's.
        episodes: Randomized episodes of the evaluation.
        least: Smallest success rate that is good enough, with the object carried where there is
            one: a box left on the ground hits no criterion of the task.
        progress: Called with the number of finished episodes and of all.

    Returns:
        The evaluation's and the export's figures.

    Raises:
        FileFormatError: Configuration or checkpoint is missing or damaged.
        InvalidOptionError: A rate is below ``least``; nothing is written.
        InvalidDataError: The policy file does not do what the network does.
        MissingDependencyError: A package of the extras ``export`` or ``viewer`` is not installed.
    """
    from omni_envs.export import export_run
    from omni_envs.training.checkpoint import FOLDER, Checkpoint
    from omni_envs.training.config import TrainConfig
    from omni_envs.training.curve import plot_curve, write_history
    from omni_envs.training.evaluate import evaluate_run
    from omni_envs.training.network_policy import find_checkpoint

    run, out = Path(run), Path(out)
    config = TrainConfig.load(run)
    state = Checkpoint.load(find_checkpoint(run))
    # The steps that it got, whatever was to end the run, and no path of this machine.
    config = replace(
        config,
        out=Path("runs") / out.resolve().name,
        steps=state.steps,
        time_limit=0.0,
        evaluation_episodes=episodes,
    )
    evaluation = evaluate_run(run, episodes=episodes, progress=progress)
    for what, rate in (
        ("success rate", evaluation.success_rate),
        ("success rate with the object carried", evaluation.carried_rate),
    ):
        if rate is not None and rate < least:
            raise InvalidOptionError(
                f"{run}: a {what} of {rate:.3f} is below the {least:.3f} asked for: train on, or "
                "publish with a lower bar."
            )
    shutil.rmtree(out / FOLDER, ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)
    _motion(config).save(out / MOTION)
    kept = replace(config, env_options={**config.env_options, "reference": MOTION})
    kept.save(out)
    # What going on would need is left out, above all the optimiser's moments.
    slim = replace(state, optimizer={}, rng=state.rng[:0], history=[], episodes=[])
    slim = replace(slim, environment=None, device_rng=None, policy=state.acting, average=None)
    slim.save(out)
    evaluation.save(out)
    history = state.history or [{"steps": state.steps, "seconds": state.seconds}]
    write_history(out, _thinned(history))
    if state.history:
        plot_curve(out, history, _control_step(config))
    exported = export_run(out, described=config)
    steps, fell = _strip(TrainConfig.load(out), Path(exported["path"]), out / STRIP)
    _write_card(out, config, state, evaluation, f"{steps} control steps" + (", a fall" * fell))
    return {**evaluation.figures(), **exported, "card": str(out / CARD)}


def _motion(config: TrainConfig) -> Reference:
    """Returns the motion that the policy tracks.

    Raises:
        InvalidOptionError: There are several: a policy file holds one.
    """
    from omni_envs.training.evaluate import make_evaluation_env

    env = make_evaluation_env(config, 1, randomized=False)
    try:
        references = env.unwrapped.references  # type: ignore[attr-defined]
    finally:
        env.close()
    if len(references) != 1:
        raise InvalidOptionError(
            f"A published policy holds one motion; this one tracks {len(references)}."
        )
    return references[0]


def _thinned(history: list[dict[str, float]], rows: int = 500) -> list[dict[str, float]]:
    """Returns about so many rows, evenly spread, the last among them."""
    every = max(1, -(-len(history) // rows))
    return history[every - 1 :: every] + (history[-1:] if len(history) % every else [])


def _control_step(config: TrainConfig) -> float:
    from omni_envs.tracking import make_config

    options = {k: v for k, v in config.env_options.items() if k in ("preset", "physics")}
    return make_config(**options).physics.control_step


def _strip(config: TrainConfig, file: Path, path: Path) -> tuple[int, bool]:
    """Draws a randomized episode under the policy file; returns its length and whether it fell."""
    import numpy as np

    from omni_envs.training.evaluate import evaluation_options
    from omni_envs.training.onnx_policy import OnnxPolicy
    from omni_envs.viewer import picture_strip, watch, write_picture

    options = evaluation_options(config.env_options, file=True)
    seen = watch(config.env, OnnxPolicy(file), env_options=options)
    chosen = np.linspace(0, len(seen.pictures) - 1, PICTURES).round().astype(int)
    write_picture(path, picture_strip([seen.pictures[i] for i in chosen], COLUMNS))
    return seen.steps, seen.terminated


def _time(seconds: float) -> str:
    """Returns a duration in words."""
    return f"{seconds / 3600:.1f} hours" if seconds >= 5400 else f"{seconds / 60:.0f} minutes"


def _write_card(
    out: Path, config: TrainConfig, state: Checkpoint, evaluation: Evaluation, episode: str
) -> None:
    from omni_envs.training.stretches import commands, machines

    low, high = evaluation.success_ci95
    possible = evaluation.episode_length_possible
    rows = [
        (
            f"success from motion start to end, {evaluation.episodes} randomized episodes",
            f"**{evaluation.success_rate:.1%}** ({low:.1%} to {high:.1%} at 95 %)",
        ),
        ("mean episode", f"{evaluation.episode_length_mean:.0f} of {possible} control steps"),
        ("body position error", f"{100 * evaluation.body_error_mean_m:.1f} cm"),
        (
            f"noise-free windows of {evaluation.window_seconds:g} s survived",
            f"{evaluation.window_survival_rate:.0%} of {evaluation.windows}",
        ),
    ]
    if evaluation.carried_rate is not None:
        text = "success with the object always within 50 cm of its reference"
        rows.insert(1, (text, f"{evaluation.carried_rate:.1%}"))
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    million = sum(run["steps"] for run in state.lineage) / 1e6
    seconds = sum(run["seconds"] for run in state.lineage)
    trained = f"{million:.{1 if million >= 1 else 3}f} million control steps in {_time(seconds)}"
    stretches = [stretch for run in state.lineage for stretch in run["stretches"]]
    if stretches:
        trained += f" on {', then '.join(machines(stretches))}"
    lines = commands(config, state.stretches, state.ancestors)
    steps = "\n".join(f"$ {line}" for line in lines)
    trainer = {"sb3": "Stable-Baselines3", "torchrl": "TorchRL"}[config.trainer]
    curve = "\n![Learning curve](curve.png)\n" if (out / "curve.png").is_file() else ""
    card = f"""# {out.name}

![A randomized episode, the reference as a ghost]({STRIP})

A policy for `{config.env}`, trained with {trainer} for {trained}.
An episode is a success when it hits no termination criterion of the task, with everything
randomized that the task randomizes. The picture shows one episode: {episode}.

| figure | value |
|---|---|
{table}

All figures: `evaluation.json`; training: `curve.csv`, `config.json`.
{curve}
## Files

* `policy.onnx`, `policy.json`: network, normalisation and motion, as BeyondMimic's deploy stack
  reads them; joint target = default + scale · action at 50 Hz.
* `reference.npz`: the motion that it tracks.
* `checkpoints/`: weights of actor and critic (`torch.load(..., weights_only=True)`).

The folder is a run directory: `omni-envs export` and `omni_envs.training.evaluate.evaluate_run`
take it.

## Trained with

```console
{steps}
```

## Licence

Apache-2.0, as the package.
"""
    (out / CARD).write_text(card)
