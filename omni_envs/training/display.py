"""What a person sees while a policy learns."""

from __future__ import annotations

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

LINE_EVERY = 15.0
"""Seconds between two lines where there is no terminal for a bar, e.g. in the log of a job."""


class TrainingDisplay:
    """A bar with speed, time left, episode length, return and tracking errors, on stderr.

    Where stderr is no terminal, a line now and then instead of a bar.

    Args:
        steps: Control steps to train for.
        time_limit: Seconds after which training ends anyway, 0 = no limit.
        control_dt: Seconds per control step.
        show: False shows nothing.
    """

    def __init__(self, steps: int, time_limit: float, control_dt: float, show: bool) -> None:
        self._steps, self._limit, self._dt = steps, time_limit, control_dt
        self._bar = show and sys.stderr.isatty()
        self._lines = show and not self._bar
        self._last_line = -float("inf")
        self._progress = Progress(
            TextColumn("Training"),
            BarColumn(bar_width=20),
            TextColumn("{task.percentage:3.0f} %  {task.fields[figures]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not self._bar,
        )
        self._task = self._progress.add_task("training", total=1.0, figures="")

    def __enter__(self) -> TrainingDisplay:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def update(self, row: dict[str, float]) -> None:
        """Shows the figures of the newest update (a row of ``RunResult.history``)."""
        done = row["steps"] / self._steps
        if self._limit:
            done = max(done, row["seconds"] / self._limit)
        figures = (
            f"{row['steps'] / 1e6:.2f} M steps  {row['steps_per_s']:.0f} steps/s  "
            f"episode {row['episode_length'] * self._dt:.2f} s  "
            f"return {row['episode_return']:.2f}  error {100 * row['body_error_m']:.1f} cm"
        )
        if "object_error_m" in row:
            figures += f"  object {100 * row['object_error_m']:.1f} cm"
        self._progress.update(self._task, completed=min(done, 1.0), figures=figures)
        now = time.monotonic()
        if self._lines and (now - self._last_line > LINE_EVERY or done >= 1.0):
            self._last_line = now
            left = row["seconds"] * (1.0 / max(done, 1e-9) - 1.0)
            print(
                f"training {min(done, 1.0):4.0%}  {figures}  {max(left, 0.0):.0f} s left",
                file=sys.stderr,
                flush=True,
            )
