"""``omni-envs curves``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from omni_envs.cli.output import show


@dataclass
class Curves:
    """Training runs → their learning curves in one picture, seeds of the same settings as one."""

    runs: tyro.conf.Positional[tuple[Path, ...]]
    """Run directories written by train.py."""

    out: Path = Path("curves.png")
    """The picture."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.training.comparison import group_runs, plot_groups

        groups = group_runs(self.runs)
        path = plot_groups(groups, self.out)
        steps = int(groups[0].steps[-1])
        if self.json:
            final = {g.label: {"runs": len(g.runs), **g.final()} for g in groups}
            show("", {"path": str(path), "steps": steps, "groups": final}, True)
            return
        rows = {
            f"{group.label}: {name}": f"{figures['mean']:.4g}"
            + (f" ± {figures['std']:.2g}" if len(group.runs) > 1 else "")
            for group in groups
            for name, figures in group.final().items()
        }
        show(f"{path}: at {steps} control steps, mean ± deviation over seeds", rows, False)
