"""``omni-envs retarget``."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import tyro

from omni_envs.cli.output import show
from omni_envs.cli.source_flags import SourceFlags
from omni_envs.errors import InvalidOptionError, OmniEnvsError


@dataclass
class Retarget:
    """One demonstration → one reference; several → several, over processes."""

    source: tyro.conf.Positional[tuple[str, ...]]
    """Demonstration files, or names of built-in demonstrations."""

    out: Path
    """Where the reference goes (.npz); a folder where there are several sources."""

    robot: str = "g1"
    """Name of the robot."""

    read: SourceFlags = field(default_factory=SourceFlags)

    fps: float = 50.0
    """Frames per second of the reference."""

    solver: Literal["daqp", "clarabel"] = "daqp"
    """Solver of the frame-by-frame pass; clarabel takes the trust region as a cone."""

    backend: Literal["mink", "placo"] = "mink"
    """Kinematics and QP; placo is there to check with."""

    refine: bool = True
    """Smooth the whole clip under the same constraints after the frame-by-frame pass."""

    jobs: int | None = None
    """Processes for several sources; one per core by default."""

    json: bool = False
    """Print JSON: one object, or a list if there are several sources."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.progress import progress_bar
        from omni_envs.references import make_reference, make_references
        from omni_envs.retargeting import RetargetOptions
        from omni_envs.robots import get_robot

        robot = get_robot(self.robot)
        options = RetargetOptions(solver=self.solver, backend=self.backend, refine=self.refine)
        several = len(self.source) > 1
        if not several and self.out.suffix != ".npz":
            raise InvalidOptionError(
                f"--out {self.out}: must end in .npz; got {self.out.suffix!r}."
            )
        demonstrations = [self.read.load(source) for source in self.source]
        names = [d.name for d in demonstrations]
        if len(set(names)) < len(names):
            raise InvalidOptionError(f"--out: sources of equal name would overwrite: {names}.")
        folder = self.out if several else self.out.parent
        folder.mkdir(parents=True, exist_ok=True)  # where it cannot be, before the work
        with progress_bar("Retargeting", disable=self.json) as progress:
            common: dict[str, Any] = {"fps": self.fps, "options": options, "progress": progress}
            if several:
                made = make_references(demonstrations, robot, jobs=self.jobs, **common)
            else:
                made = [make_reference(demonstrations[0], robot, **common)]
        rows, failed = [], []
        for demonstration, reference in zip(demonstrations, made, strict=True):
            if isinstance(reference, OmniEnvsError):
                failed.append(f"{demonstration.name}: {reference}")
                continue
            path = self.out / f"{demonstration.name}.npz" if several else self.out
            reference.save(path)
            assert reference.report is not None  # make_reference always evaluates
            rows.append({**reference.report.summary(), **_speed(reference)})
            if not self.json:
                show(f"{demonstration.name} → {robot.title}: {path}", rows[-1], False)
        if self.json:
            print(json.dumps(rows if several else rows[0], allow_nan=False))
        if failed:
            raise OmniEnvsError("; ".join(failed))


def _speed(reference: Any) -> dict[str, float]:
    seconds = float(reference.provenance["solve_seconds"])
    frames = int(reference.provenance["solved_frames"])
    return {"solve_seconds": seconds, "frames_per_s": frames / seconds}
