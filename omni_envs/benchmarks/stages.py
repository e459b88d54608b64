"""Where the time of a run goes, without touching the code that runs."""

from __future__ import annotations

import signal
from collections import Counter
from collections.abc import Mapping
from types import FrameType
from typing import Any

PERIOD = 5e-4
"""Seconds between two looks."""


class StageSampler:
    """Looks at regular times which function is running, and counts stages.

    A sample belongs to the stage of the innermost module with one, unless a function further out
    claims everything it calls. Needs the timers of POSIX systems, and the main thread.

    Args:
        modules: Module to stage.
        functions: Function of these modules to the stage that claims everything it calls.
    """

    def __init__(self, modules: Mapping[str, str], functions: Mapping[str, str]) -> None:
        self._modules, self._functions = modules, functions
        self._counts: Counter[str] = Counter()

    @staticmethod
    def available() -> bool:
        """Whether the system has what it takes."""
        return hasattr(signal, "setitimer")

    def __enter__(self) -> StageSampler:
        self._handler: Any = signal.signal(signal.SIGALRM, self._look)
        signal.setitimer(signal.ITIMER_REAL, PERIOD, PERIOD)
        return self

    def __exit__(self, *exception: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, self._handler)

    def shares(self) -> dict[str, float]:
        """Share of the time by stage, the largest first; empty without a sample."""
        counts = Counter(self._counts)  # the signal may add a sample at any moment
        total = counts.total()
        return {stage: count / total for stage, count in counts.most_common()}

    def _look(self, signum: int, frame: FrameType | None) -> None:
        stage = claimed = None
        while frame is not None:
            module = frame.f_globals.get("__name__", "")
            if module in self._modules:
                stage = stage or self._modules[module]
                claimed = self._functions.get(frame.f_code.co_name, claimed)
            frame = frame.f_back
        self._counts[claimed or stage or "other"] += 1
