"""Checkpoints of a training run: everything needed to go on after a kill, without pickles."""

from __future__ import annotations

import pickle
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omni_envs.errors import FileFormatError, MissingDependencyError
from omni_envs.files import complete_file

try:
    import torch
    from torch import Tensor
except ImportError as error:
    raise MissingDependencyError("torch", "sb3", "Reading a training run") from error

FOLDER = "checkpoints"
_NAME = re.compile(r"step_(\d+)\.pt")
_FORMAT = 4
_READ = (1, 2, 3, 4)
"""Formats that are read; 1 had no state of the environment, 2 no average, 3 no ancestors."""


@dataclass
class Checkpoint:
    """State of a training run between two updates.

    Attributes:
        steps: Control steps trained for.
        seconds: Training time so far, resumed runs together.
        updates: Updates of the network.
        learning_rate: Learning rate of the next update.
        policy: Weights and observation statistics.
        optimizer: State of the optimiser.
        rng: State of torch's random generator.
        stretches: Where and with which settings the run was trained, and from which step on; see
            ``omni_envs.training.stretches``.
        ancestors: ``steps``, ``seconds`` and ``stretches`` of the runs that the networks come from,
            oldest first; see ``omni_envs.training.fine_tuning``.
        environment: What episodes have taught the environment; see ``environment.learning_state``.
            None in a file of format 1, and where the environment does not learn.
        device_rng: State of the GPU's random generator, or None for training on the CPU.
        average: ``WeightAverage.state`` of the actor, or None where none is kept.
        history: One row of figures per update.
        episodes: Return and length of the episodes that finished last, which the means in
            ``history`` are over.
    """

    steps: int
    seconds: float
    updates: int
    learning_rate: float
    policy: dict[str, Tensor]
    optimizer: dict[str, Any]
    rng: Tensor
    history: list[dict[str, float]] = field(default_factory=list)
    episodes: list[tuple[float, float]] = field(default_factory=list)
    stretches: list[dict[str, Any]] = field(default_factory=list)
    ancestors: list[dict[str, Any]] = field(default_factory=list)
    environment: dict[str, Any] | None = None
    device_rng: Tensor | None = None
    average: dict[str, Any] | None = None

    @property
    def lineage(self) -> list[dict[str, Any]]:
        """The ancestors and, last, this run, as one of theirs."""
        own = {"steps": self.steps, "seconds": self.seconds, "stretches": self.stretches}
        return [*self.ancestors, own]

    @property
    def acting(self) -> dict[str, Tensor]:
        """Weights of the policy to evaluate and to export: averaged ones where there are any."""
        return {**self.policy, **self.average["weights"]} if self.average else self.policy

    def save(self, run: Path) -> Path:
        """Writes the checkpoint into a run directory; it is there whole or not at all."""
        path = run / FOLDER / f"step_{self.steps:012d}.pt"
        with complete_file(path) as temporary:
            torch.save({"format": _FORMAT, **_on_cpu(vars(self))}, temporary)
        return path

    @classmethod
    def load(cls, path: Path) -> Checkpoint:
        """Reads a checkpoint.

        Raises:
            FileFormatError: It is missing, damaged or of another version.
        """
        if not path.is_file():
            raise FileFormatError(path, "file", "a checkpoint", "nothing")
        try:
            data = torch.load(path, map_location="cpu", weights_only=True)
        except (RuntimeError, OSError, EOFError, pickle.UnpicklingError, ValueError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise FileFormatError(path, "content", "a whole checkpoint", reason) from error
        if not isinstance(data, dict) or data.pop("format", None) not in _READ:
            versions = " or ".join(map(str, _READ))
            raise FileFormatError(path, "format", f"version {versions}", "another one")
        try:
            return cls(**data)
        except TypeError as error:
            raise FileFormatError(path, "fields", "those of a checkpoint", str(error)) from error


def _on_cpu(data: Any) -> Any:
    """Returns nested data with every tensor on the CPU: files do not tell where they were made."""
    if isinstance(data, Tensor):
        return data.cpu()
    if isinstance(data, dict):
        return {key: _on_cpu(value) for key, value in data.items()}
    return [_on_cpu(value) for value in data] if isinstance(data, list) else data


def checkpoints(run: Path) -> list[Path]:
    """Returns the checkpoints of a run directory, oldest first; unfinished files do not count."""
    found = [p for p in (run / FOLDER).glob("step_*.pt") if _NAME.fullmatch(p.name)]
    return sorted(found, key=lambda p: int(_NAME.fullmatch(p.name)[1]))  # type: ignore[index]


def keep_newest(run: Path, count: int) -> None:
    """Deletes all checkpoints but the first (the untrained policy) and the newest ``count``."""
    for path in checkpoints(run)[1:-count]:
        path.unlink()
