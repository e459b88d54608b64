"""Learning curves of several runs in one picture; runs that differ by seed alone are one curve."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.errors import FileFormatError, InvalidDataError, MissingDependencyError
from omni_envs.training.config import TrainConfig
from omni_envs.training.curve import CURVE_CSV, smoothed

ITS_OWN = ("seed", "out", "num_threads", "device", "steps", "time_limit", "checkpoint_every")
"""Fields of ``TrainConfig`` that do not change what is learnt."""
COLOURS = ("#1f5fa8", "#d1662b", "#3c8f53", "#8a4fa3", "#a8871f", "#4d4d4d")
_OBJECT = "object_error_m"
PANELS = (
    ("episode_length", "episode length (control steps)", 1.0),
    ("episode_return", "return per episode", 1.0),
    ("body_error_m", "mean body position error (cm)", 100.0),
    (_OBJECT, "mean object position error (cm)", 100.0),
)
"""Column of ``curve.csv``, title, factor to its unit. The last is drawn where all runs have it."""
POINTS = 400


@dataclass(frozen=True)
class Group:
    """Runs that differ by seed alone, over the steps that all compared runs reached.

    Attributes:
        label: The settings that set this group apart, e.g. ``"trainer sb3"``.
        runs: Run directories.
        steps: (P,) control steps.
        curves: Column of ``curve.csv`` to (R, P) values of the runs, smoothed.
    """

    label: str
    runs: tuple[Path, ...]
    steps: np.ndarray
    curves: dict[str, np.ndarray]

    def final(self) -> dict[str, dict[str, float]]:
        """Returns mean and standard deviation over the runs at the last common step."""
        return {
            name: {
                "mean": float(values[:, -1].mean()),
                "std": float(values[:, -1].std(ddof=1)) if len(values) > 1 else 0.0,
            }
            for name, values in self.curves.items()
        }


def group_runs(runs: Sequence[str | Path]) -> tuple[Group, ...]:
    """Reads runs and puts those that differ by seed alone together.

    Args:
        runs: Run directories.

    Raises:
        FileFormatError: Configuration or curve of a run is missing or damaged.
        InvalidDataError: There is nothing to compare.
    """
    found = [(Path(run), _settings(Path(run)), _columns(Path(run))) for run in runs]
    if not found:
        raise InvalidDataError("Comparison", "runs", "at least one run directory", "none")
    last = min(columns["steps"].max(initial=0.0) for _, _, columns in found)
    first = max(columns["steps"].min(initial=np.inf) for _, _, columns in found)
    if not first < last:
        raise InvalidDataError("Comparison", "runs", "updates at the same steps", "none")
    steps = np.linspace(first, last, POINTS)
    different = {
        name
        for _, settings, _ in found
        for name in settings
        if any(other.get(name) != settings[name] for _, other, _ in found)
    }
    drawn = [key for key, *_ in PANELS if all(key in columns for _, _, columns in found)]
    groups: dict[str, list[tuple[Path, dict[str, np.ndarray]]]] = {}
    for run, settings, columns in found:
        words = [f"{name} {settings[name]}" for name in sorted(different & set(settings))]
        groups.setdefault(", ".join(words) or "all runs", []).append((run, columns))
    return tuple(
        Group(
            label,
            tuple(run for run, _ in members),
            steps,
            {
                key: np.stack([np.interp(steps, c["steps"], smoothed(c[key])) for _, c in members])
                for key in drawn
            },
        )
        for label, members in groups.items()
    )


def plot_groups(groups: Sequence[Group], path: str | Path) -> Path:
    """Draws the mean of each group over the steps, and the range of its runs.

    Args:
        groups: From ``group_runs``.
        path: Picture to write.

    Raises:
        MissingDependencyError: Matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError("matplotlib", "viewer", "Drawing a curve") from error
    panels = [panel for panel in PANELS if all(panel[0] in group.curves for group in groups)]
    figure = Figure(figsize=(4.0 * len(panels), 3.8), layout="constrained")
    for axes, (key, title, scale) in zip(figure.subplots(1, len(panels)), panels, strict=True):
        for i, group in enumerate(groups):
            values, colour = group.curves[key] * scale, COLOURS[i % len(COLOURS)]
            million = group.steps / 1e6
            axes.fill_between(million, values.min(0), values.max(0), color=colour, alpha=0.15)
            axes.plot(million, values.T, color=colour, linewidth=0.5, alpha=0.5)
            label = f"{group.label} ({len(values)} seeds)" if len(values) > 1 else group.label
            axes.plot(million, values.mean(0), color=colour, linewidth=2.0, label=label)
        axes.set_xlabel("control steps (million)")
        axes.set_title(title, fontsize=10)
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
    return path


def _settings(run: Path) -> dict[str, Any]:
    data = TrainConfig.load(run).to_dict()
    ppo = {f"ppo.{name}": value for name, value in data.pop("ppo").items()}
    return {k: v for k, v in (data | ppo).items() if k not in ITS_OWN}


def _columns(run: Path) -> dict[str, np.ndarray]:
    path = run / CURVE_CSV
    if not path.is_file():
        raise FileFormatError(path, "file", "the curve of a training run", "nothing")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    try:
        names = ["steps", *(panel[0] for panel in PANELS)]
        # Without an object, or in the first rows of a run of an earlier version, there is no error.
        if not all(row.get(_OBJECT) for row in rows):
            names.remove(_OBJECT)
        columns = {name: np.array([float(row[name]) for row in rows]) for name in names}
    except (KeyError, TypeError, ValueError) as error:
        raise FileFormatError(path, "columns", "numbers", repr(error)) from error
    if not rows:
        raise FileFormatError(path, "rows", "at least one update", "none")
    known = np.isfinite(columns["episode_length"])
    return {k: v[known] for k, v in columns.items()}
