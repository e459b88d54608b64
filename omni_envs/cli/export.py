"""``omni-envs export``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from omni_envs.cli.output import show


@dataclass
class Export:
    """A trained run → a policy file for a deploy stack."""

    run_dir: tyro.conf.Positional[Path]
    """Run directory written by train.py."""

    profile: Literal["beyondmimic", "holosoma", "unitree"] = "beyondmimic"
    """Convention of the file: whose deploy stack reads it."""

    out: Path | None = None
    """Where the file goes; RUN/policy.onnx by default, RUN/PROFILE/policy.onnx for the others."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.export import export_run

        rows = export_run(self.run_dir, profile=self.profile, out=self.out)
        show(f"{self.run_dir} → {rows['path']}", rows, self.json)
