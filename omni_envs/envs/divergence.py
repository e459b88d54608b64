"""Simulations that blew up: what they were before, so that the step can be replayed."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

KEPT = 16
"""Diverged simulations that an environment remembers."""


@dataclass(frozen=True, eq=False)
class Divergence:
    """The state of a simulation before the control step in which it diverged.

    Attributes:
        simulation: Its index in the environment.
        motion: Motion that it tracked.
        frame: Frame that it was to track.
        qpos: (nq,).
        qvel: (nv,).
        qacc_warmstart: (nv,) where the solver started.
        ctrl: (n,) joint targets of the step, rad.
        variant: Index of its randomized model.
    """

    simulation: int
    motion: int
    frame: int
    qpos: np.ndarray
    qvel: np.ndarray
    qacc_warmstart: np.ndarray
    ctrl: np.ndarray
    variant: np.ndarray

    def save(self, path: str | Path) -> Path:
        """Writes one ``.npz`` of arrays with the names of the attributes."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            arrays: dict[str, Any] = {k: np.asarray(v) for k, v in vars(self).items()}
            np.savez(file, **arrays)
        return path


class DivergenceLog(deque[Divergence]):
    """The latest diverged simulations, at most ``KEPT``."""

    def __init__(self) -> None:
        super().__init__(maxlen=KEPT)
