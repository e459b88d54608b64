"""``omni-envs evaluate``."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import tyro

from omni_envs.cli.output import console
from omni_envs.cli.source_flags import SourceFlags
from omni_envs.errors import InvalidOptionError


@dataclass
class Evaluate:
    """Metrics of references, ours or a peer's, held against the quality bars.

    One table, a column per file; with --details every figure, with --json the numbers.
    """

    references: tyro.conf.Positional[tuple[Path, ...]]
    """Reference files, or robot motions of OmniRetarget's dataset and holosoma (.npz)."""

    source: str | None = None
    """What a peer's motion was made from: a demonstration file or the name of a built-in one. Our
    own references carry it."""

    robot: str = "g1"
    """Robot of a peer's motion."""

    read: SourceFlags = field(default_factory=SourceFlags)

    picture: Path | None = None
    """Draw the report of a single reference on a page (.png, .pdf or .svg)."""

    details: bool = False
    """Print every figure, not only the headlines."""

    json: bool = False
    """Print JSON: one object per file, in a list if there are several files."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.metrics import bars_table, missed_contacts, summary_table
        from omni_envs.references import evaluate_reference, open_reference, report_picture

        if self.picture is not None and len(self.references) != 1:
            raise InvalidOptionError("--picture: draws one reference; give a single file.")
        demonstration = None if self.source is None else self.read.load(self.source)
        rows, misses = [], []
        for path in self.references:
            reference = open_reference(path, self.robot, demonstration)
            report = evaluate_reference(reference)
            if self.picture is not None:
                report_picture(replace(reference, report=report), self.picture)
            rows.append(report.details() if self.details else report.summary())
            misses.append(missed_contacts(report))
        if self.json:
            print(json.dumps(rows[0] if len(rows) == 1 else rows, allow_nan=False))
            return
        headings = _headings(self.references)
        columns = dict(zip(headings, rows, strict=True))
        console.print(summary_table(columns) if self.details else bars_table(columns))
        for heading, missed in zip(headings, misses, strict=True):
            if missed:
                told = ", ".join(map(str, missed))
                console.print(f"{heading} does not reach what the human touches: {told}")


def _headings(paths: tuple[Path, ...]) -> list[str]:
    """Names of the files, whole paths where names repeat, numbered where these do."""
    names = [path.stem for path in paths]
    if len(set(names)) < len(names):
        names = [str(path) for path in paths]
    repeated = len(set(names)) < len(names)
    return [f"{i + 1} {name}" if repeated else name for i, name in enumerate(names)]
