"""The figures of a policy, as they are saved beside it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

EVALUATION_FILE = "evaluation.json"


@dataclass(frozen=True)
class MotionEvaluation:
    """Figures of one of several motions; see ``Evaluation``.

    Attributes:
        motion: Its place in the order given.
        episodes: Episodes of it.
        success_rate: Share of them that hit no termination criterion.
        success_ci95: Its 95 % confidence interval (Wilson).
        episode_length_mean: Control steps.
        episode_length_possible: Control steps of the whole motion.
    """

    motion: int
    episodes: int
    success_rate: float
    success_ci95: tuple[float, float]
    episode_length_mean: float
    episode_length_possible: int


@dataclass(frozen=True)
class Evaluation:
    """Figures of a policy; an episode runs from the motion's first frame to its end.

    Attributes:
        success_rate: Share of episodes that hit no termination criterion, under the evaluation
            randomization.
        success_ci95: Its 95 % confidence interval (Wilson).
        carried_rate: Share of episodes that succeed with the object never further than 0.5 m from
            its reference, stricter than the task; None without an object.
        episodes: Number of episodes.
        episode_length_mean: Control steps.
        episode_length_possible: Control steps of a whole motion, of the longest of several.
        return_mean: Undiscounted return per episode.
        body_error_mean_m: Distance of the tracked bodies from the re-aligned reference, m.
        window_survival_rate: Share of noise-free windows, spread evenly over the motion, that hit
            no termination criterion.
        window_seconds_mean: Mean time alive in a window, s.
        window_body_error_mean_m: As ``body_error_mean_m``, in the windows.
        windows: Number of windows.
        window_seconds: Length of a window, s.
        steps: Control steps of the run, without those of runs that it began with.
        seconds: Its training time, likewise.
        motions: Each motion by itself where there are several, which take turns in the episodes.
    """

    success_rate: float
    success_ci95: tuple[float, float]
    carried_rate: float | None
    episodes: int
    episode_length_mean: float
    episode_length_possible: int
    return_mean: float
    body_error_mean_m: float
    window_survival_rate: float
    window_seconds_mean: float
    window_body_error_mean_m: float
    windows: int
    window_seconds: float
    steps: int
    seconds: float
    motions: tuple[MotionEvaluation, ...] = ()

    def figures(self) -> dict[str, Any]:
        """Returns everything as JSON-compatible data, ``motions`` only where there are several."""
        data = asdict(self)
        return data if self.motions else {k: v for k, v in data.items() if k != "motions"}

    def save(self, run: str | Path) -> Path:
        """Writes ``evaluation.json`` into a run directory."""
        path = Path(run) / EVALUATION_FILE
        path.write_text(json.dumps(self.figures(), indent=2, allow_nan=False) + "\n")
        return path
