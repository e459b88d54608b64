"""``omni-envs publish``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from omni_envs.cli.output import show
from omni_envs.progress import progress_bar


@dataclass
class Publish:
    """A finished run → a folder with weights, policy file, evaluation, pictures and a card."""

    run_dir: tyro.conf.Positional[Path]
    """Run directory written by train.py."""

    out: Path
    """The folder, e.g. policies/g1_box_carry."""

    episodes: int = 200
    """Randomized episodes of the evaluation."""

    least: float = 0.0
    """Rate of success, the object carried, below which nothing is published."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.publish import publish

        with progress_bar("Evaluating", unit="episodes", disable=self.json) as progress:
            rows = publish(
                self.run_dir,
                self.out,
                episodes=self.episodes,
                least=self.least,
                progress=progress,
            )
        show(f"{self.run_dir} → {self.out}", rows, self.json)
