"""The learning curve of a run, as numbers and as a picture."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from omni_envs.errors import InvalidDataError, MissingDependencyError
from omni_envs.files import complete_file

History = Sequence[dict[str, float]]

CURVE_CSV, CURVE_PNG = "curve.csv", "curve.png"


def write_history(run: Path, history: History) -> Path:
    """Writes one row per update as ``curve.csv``, atomically."""
    path = run / CURVE_CSV
    names = list(dict.fromkeys(name for row in history for name in row))
    with complete_file(path) as temporary, temporary.open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(history)
    return path


def plot_curve(run: Path, history: History, control_dt: float) -> Path:
    """Draws episode length, return and tracking errors over the steps trained for.

    Args:
        run: Run directory; ``curve.png`` is written there.
        history: Rows of ``RunResult.history``.
        control_dt: Seconds per control step.

    Raises:
        InvalidDataError: There is nothing to draw.
        MissingDependencyError: Matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError("matplotlib", "viewer", "Drawing a curve") from error
    if not history:
        raise InvalidDataError("Learning curve", "history", "at least one update", "none")
    steps = [row["steps"] / 1e6 for row in history]
    panels = [
        ("episode_length", "episode length (s)", control_dt),
        ("episode_return", "return per episode", 1.0),
        ("body_error_m", "mean body position error (cm)", 100.0),
    ]
    if any("object_error_m" in row for row in history):
        panels.append(("object_error_m", "mean object position error (cm)", 100.0))
    figure = Figure(figsize=(4.0 * len(panels), 3.4), layout="constrained")
    for axes, (key, title, scale) in zip(figure.subplots(1, len(panels)), panels, strict=True):
        # Rows of earlier versions have fewer columns.
        values = np.array([row.get(key, np.nan) * scale for row in history])
        axes.plot(steps, values, color="#1f5fa8", linewidth=0.6, alpha=0.35)
        axes.plot(steps, smoothed(values), color="#1f5fa8", linewidth=1.8)
        axes.set_xlabel("control steps (million)")
        axes.set_title(title, fontsize=10)
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    minutes = history[-1]["seconds"] / 60
    figure.suptitle(f"{steps[-1]:.2f} M control steps in {minutes:.1f} minutes", fontsize=11)
    path = run / CURVE_PNG
    figure.savefig(path, dpi=120)
    return path


def smoothed(values: np.ndarray) -> np.ndarray:
    """Returns the mean of the last 2 % of all values up to each one; NaN does not count."""
    window = max(1, len(values) // 50)
    known = np.isfinite(values)
    total = np.cumsum(np.where(known, values, 0.0))
    count = np.cumsum(known)
    total[window:] -= total[:-window].copy()
    count[window:] -= count[:-window].copy()
    return np.divide(total, count, out=np.full(len(values), np.nan), where=count > 0)
