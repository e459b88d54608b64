"""``omni-envs demo``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omni_envs.cli.output import show


@dataclass
class Demo:
    """The whole story in minutes: demonstration → reference → policy → ONNX → video."""

    out: Path = Path("out/demo")
    """Folder for everything the demo makes."""

    minutes: float = 4.0
    """Training time."""

    seed: int = 0
    """Seed of the training."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.demo import run_demo

        rows = run_demo(self.out, minutes=self.minutes, seed=self.seed, quiet=self.json)
        show("What the demo made", rows, self.json)
