"""Simulations that blew up: what they were before, and the control step played again."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from omni_envs.envs.simulation import Simulation
from omni_envs.errors import FileFormatError, InvalidDataError

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

    @classmethod
    def load(cls, path: str | Path) -> Divergence:
        """Reads what ``save`` wrote.

        Raises:
            FileFormatError: The file is missing, or no such file.
        """
        path, names = Path(path), [f.name for f in fields(cls)]
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = {name: file[name] for name in names}
        except (OSError, KeyError, ValueError) as error:
            raise FileFormatError(path, "arrays", ", ".join(names), str(error)) from error
        simulation, motion, frame = (int(arrays.pop(k)) for k in ("simulation", "motion", "frame"))
        return cls(simulation, motion, frame, **arrays)


class Replay(NamedTuple):
    """A control step played again, physics step by physics step.

    Attributes:
        qpos: (substeps + 1, nq), the state before the step first.
        qvel: (substeps + 1, nv).
        warnings: (substeps + 1,) MuJoCo's count of bad states so far. A state that MuJoCo found bad
            it has put back to the model's zero pose.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    warnings: np.ndarray


def replay(simulation: Simulation, divergence: Divergence) -> Replay:
    """Plays the control step of a divergence again, to the bit.

    Args:
        simulation: That of an environment with the same options; it is left as it is.
        divergence: What to play, from ``env.divergences`` or ``Divergence.load``.

    Raises:
        InvalidDataError: The divergence is of another model.
    """
    for name, size in (("qpos", simulation.model.nq), ("qvel", simulation.model.nv)):
        found = getattr(divergence, name).shape
        if found != (size,):
            raise InvalidDataError(
                "Divergence", name, f"({size},), as the environment's", f"{found}"
            )
    batch = simulation.alone(int(divergence.variant))
    for name in ("qpos", "qvel", "qacc_warmstart", "ctrl"):
        batch.bind(name)[0] = getattr(divergence, name)
    qpos, qvel, bad = [divergence.qpos], [divergence.qvel], [0]
    for _ in range(simulation.substeps):
        batch.step()
        qpos.append(batch.bind("qpos")[0].copy())
        qvel.append(batch.bind("qvel")[0].copy())
        bad.append(simulation.bad_states(batch)[0])
    return Replay(np.array(qpos), np.array(qvel), np.array(bad))


class DivergenceLog(deque[Divergence]):
    """The latest diverged simulations, at most ``KEPT``."""

    def __init__(self) -> None:
        super().__init__(maxlen=KEPT)
