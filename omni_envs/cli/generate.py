"""``omni-envs generate``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from omni_envs.cli.output import show
from omni_envs.errors import InvalidOptionError, OmniEnvsError


@dataclass
class Generate:
    """A dataset from a recipe: demonstrations × robots × variations; resumes where it was ended."""

    recipe: tyro.conf.Positional[Path]
    """A recipe (.yaml), see `omni_envs.generation.recipe`."""

    out: Path
    """Folder of the dataset."""

    jobs: int | None = None
    """Workers; one per core by default."""

    engine: Literal["local", "ray"] = "local"
    """Processes of this machine, or a Ray cluster."""

    shard: str = "1/1"
    """i/n makes the i-th of n equal parts."""

    previews: int = 12
    """Most pictures of the dataset card."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.generation import generate, read_recipe
        from omni_envs.progress import progress_bar

        match = re.fullmatch(r"(\d+)/(\d+)", self.shard)
        if not match:
            raise InvalidOptionError(f"--shard: expected i/n, e.g. 1/4; got {self.shard!r}.")
        recipe = read_recipe(self.recipe)
        with progress_bar("Generating", disable=self.json) as progress:
            rows = generate(
                recipe,
                self.out,
                jobs=self.jobs,
                engine=self.engine,
                shard=(int(match[1]), int(match[2])),
                previews=self.previews,
                progress=progress,
            )
        show(str(self.out), rows, self.json)
        if rows["failed"]:
            raise OmniEnvsError(
                f"{rows['failed']} of {rows['items']} could not be made; {self.out / 'README.md'} "
                "says why."
            )
