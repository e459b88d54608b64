"""The whole story in minutes: demonstration → reference → policy → ONNX → video."""

from __future__ import annotations

import importlib
import shutil
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.errors import MissingDependencyError
from omni_envs.progress import progress_bar
from omni_envs.references import Reference, make_reference
from omni_envs.robots import get_robot

if TYPE_CHECKING:
    from omni_envs.training.evaluate import Evaluation

ENV, ROBOT, DEMONSTRATION = "OmniEnvs/G1BoxCarry-v0", "g1", "box_carry"
RECIPE, MOST_STEPS, EPISODES = "quick", 10**9, 64
PICTURES, COLUMNS = 12, 6

_NEEDS = (
    ("stable_baselines3", "sb3"),
    ("tensorboard", "sb3"),
    ("onnx", "export"),
    ("onnxruntime", "export"),
    ("imageio", "viewer"),
    ("matplotlib", "viewer"),
)


def run_demo(
    out: str | Path, *, minutes: float = 4.0, seed: int = 0, quiet: bool = False
) -> dict[str, Any]:
    """Runs the demo; a run of it in the same folder is replaced.

    Args:
        out: Folder for everything that it makes.
        minutes: Training time.
        seed: Seed of the training.
        quiet: Print nothing.

    Returns:
        Figures and paths.

    Raises:
        MissingDependencyError: An extra is missing that training, export or video need.
    """
    for package, extra in _NEEDS:
        try:
            importlib.import_module(package)
        except ImportError as error:
            raise MissingDependencyError(package, extra, "The demo") from error
    from omni_envs.export import export_run
    from omni_envs.training.curve import plot_curve
    from omni_envs.training.evaluate import evaluate_run
    from omni_envs.training.recipes import RECIPES
    from omni_envs.training.run import train

    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    console = Console(stderr=True, quiet=quiet)
    begin = time.perf_counter()

    console.rule("[bold]1. demonstration → reference", align="left")
    reference = _make_reference(out, console, quiet)

    console.rule("[bold]2. reference → policy", align="left")
    run = out / "run"
    if (run / "config.json").is_file():
        shutil.rmtree(run)
    config = RECIPES[RECIPE].config(
        ENV,
        run,
        MOST_STEPS,
        time_limit=60.0 * minutes,
        seed=seed,
        env_options={"reference": str(out / "reference.npz")},
        evaluation_episodes=EPISODES,
    )
    trained = train(config, progress=not quiet)

    console.rule("[bold]3. evaluation, before and after", align="left")
    with progress_bar("Untrained", "episodes", quiet) as progress:
        before = evaluate_run(run, which="first", progress=progress)
    with progress_bar("Trained", "episodes", quiet) as progress:
        after = evaluate_run(run, progress=progress)
    after.save(run)
    console.print(_comparison(before, after))

    console.rule("[bold]4. policy → ONNX", align="left")
    exported = export_run(run)
    console.print(
        f"{exported['path']}: differs from the network by {exported['parity_max_abs']:.1e} at most"
    )

    console.rule("[bold]5. looking at it", align="left")
    pictures = _watch(out, run, Path(exported["path"]), console)
    return {
        "reference": str(out / "reference.npz"),
        "reference_strip": str(out / "reference.png"),
        "policy": str(exported["path"]),
        **pictures,
        "curve": str(plot_curve(run, trained.history, trained.control_dt)),
        "penetration_max_m": reference.report.summary()["penetration_max_m"],  # type: ignore[union-attr]
        "steps": trained.steps,
        "steps_per_s": trained.steps / trained.seconds,
        "episode_length_before": before.episode_length_mean,
        "episode_length_after": after.episode_length_mean,
        "window_seconds_before": before.window_seconds_mean,
        "window_seconds_after": after.window_seconds_mean,
        "window_body_error_before_m": before.window_body_error_mean_m,
        "window_body_error_after_m": after.window_body_error_mean_m,
        "parity_max_abs": exported["parity_max_abs"],
        "closed_loop_return": exported["closed_loop_return"],
        "seconds": time.perf_counter() - begin,
    }


def _make_reference(out: Path, console: Console, quiet: bool) -> Reference:
    from omni_envs.viewer import reference_strip

    robot = get_robot(ROBOT)
    demonstration = builtin_demonstration(DEMONSTRATION)
    with progress_bar(f"{DEMONSTRATION} → {robot.title}", disable=quiet) as progress:
        reference = make_reference(demonstration, robot, progress=progress)
    reference.save(out / "reference.npz")
    reference_strip(reference, out / "reference.png", pictures=PICTURES, columns=COLUMNS)
    console.print(_proof(reference))
    return reference


def _proof(reference: Reference) -> str:
    assert reference.report is not None
    figures: dict[str, Any] = dict(reference.report.summary())
    return (
        f"{figures['frames']} frames at {figures['fps']:.0f} fps; "
        f"penetration {1e3 * figures['penetration_max_m']:.2f} mm at most, "
        f"stance drift {1e3 * figures['stance_drift_max_m']:.1f} mm at most, "
        f"hands on the box in {figures['contact_fraction_2cm']:.0%} of the frames that ask for it, "
        f"joint and speed limits exceeded by {figures['joint_violation_max_rad']:.0e} rad "
        f"and {figures['velocity_violation_max_rad_s']:.0e} rad/s"
    )


def _comparison(before: Evaluation, after: Evaluation) -> str:
    return (
        f"episode from motion start: {before.episode_length_mean:.0f} → "
        f"{after.episode_length_mean:.0f} of {after.episode_length_possible} control steps\n"
        f"alive in {after.window_seconds:.0f} s windows all over the motion: "
        f"{before.window_seconds_mean:.2f} → {after.window_seconds_mean:.2f} s\n"
        f"body position error in them: {100 * before.window_body_error_mean_m:.1f} → "
        f"{100 * after.window_body_error_mean_m:.1f} cm"
    )


def _watch(out: Path, run: Path, policy_file: Path, console: Console) -> dict[str, str]:
    import numpy as np

    from omni_envs.training.config import TrainConfig
    from omni_envs.training.evaluate import evaluation_options
    from omni_envs.training.onnx_policy import OnnxPolicy
    from omni_envs.viewer import picture_strip, watch, write_picture, write_video

    options = evaluation_options(TrainConfig.load(run).env_options, randomized=False, file=True)
    seen = watch(ENV, OnnxPolicy(policy_file), env_options=options)
    end = "fell" if seen.terminated else "reached the end"
    console.print(f"the policy file, from the start of the motion: {seen.steps} steps, {end}")
    chosen = np.linspace(0, len(seen.pictures) - 1, PICTURES).round().astype(int)
    strip = picture_strip([seen.pictures[i] for i in chosen], COLUMNS)
    return {
        "video": str(write_video(out / "policy.mp4", seen.pictures, seen.fps)),
        "policy_strip": str(write_picture(out / "policy.png", strip)),
    }
