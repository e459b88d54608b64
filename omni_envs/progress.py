"""The one progress bar of the package."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

ProgressCallback = Callable[[int, int], None]
"""Called with (done, total) as work goes on."""


@contextmanager
def progress_bar(
    title: str, unit: str = "frames", disable: bool = False
) -> Iterator[ProgressCallback]:
    """Shows a bar on stderr with rate and time left, fed by the callback it yields.

    The bar appears with the first call: work that turns out to be done already shows none.

    Args:
        title: What is being done.
        unit: What is counted.
        disable: Show nothing; the callback still works.

    Yields:
        A ``ProgressCallback``.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    progress = Progress(*columns, console=Console(stderr=True), disable=disable)
    task = progress.add_task(title, total=None, rate="")

    def update(done: int, total: int) -> None:
        progress.start()
        speed = progress.tasks[0].speed
        rate = f"{speed:.0f} {unit}/s" if speed else ""
        progress.update(task, completed=done, total=total, rate=rate)

    try:
        yield update
    finally:
        progress.stop()
