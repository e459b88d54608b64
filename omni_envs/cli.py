"""The ``omni-envs`` command."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.console import Console
from rich.table import Table

from omni_envs.errors import OmniEnvsError

_console = Console()


def _show(title: str, rows: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps(rows, allow_nan=False))
        return
    table = Table(title=title, title_justify="left")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for key, value in rows.items():
        table.add_row(key, f"{value:.6g}" if isinstance(value, float) else str(value))
    _console.print(table)


@dataclass
class List:
    """What there is: environments, robots, built-in demonstrations."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.demonstrations import builtin_names
        from omni_envs.registration import ENVIRONMENTS
        from omni_envs.robots import robot_names

        what = {
            "environments": [env.id for env in ENVIRONMENTS],
            "robots": list(robot_names()),
            "demonstrations": list(builtin_names()),
        }
        if self.json:
            print(json.dumps(what))
            return
        for key, names in what.items():
            _console.print(f"[bold]{key}[/bold]  {', '.join(names)}")


@dataclass
class Retarget:
    """One demonstration → one reference; several → several, over processes."""

    source: tyro.conf.Positional[tuple[str, ...]]
    """Demonstration files, or names of built-in demonstrations."""

    out: Path
    """Where the reference goes (.npz); a folder where there are several sources."""

    robot: str = "g1"
    """Name of the robot."""

    object: Path | None = None
    """Mesh of the object, where the source does not carry it."""

    terrain: Path | None = None
    """Mesh of the terrain at human scale."""

    height: float | None = None
    """Standing height of the human in metres, where the source does not tell it."""

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
        from omni_envs.demonstrations import load_demonstration
        from omni_envs.errors import InvalidOptionError
        from omni_envs.progress import progress_bar
        from omni_envs.references import make_reference, make_references
        from omni_envs.retargeting import RetargetOptions
        from omni_envs.robots import get_robot

        robot = get_robot(self.robot)
        options = RetargetOptions(solver=self.solver, backend=self.backend, refine=self.refine)
        several = len(self.source) > 1
        if not several:
            _check_suffix(self.out, ".npz")
        demonstrations = [
            load_demonstration(
                source, object_mesh=self.object, terrain_mesh=self.terrain, height=self.height
            )
            for source in self.source
        ]
        names = [d.name for d in demonstrations]
        if len(set(names)) < len(names):
            raise InvalidOptionError(f"--out: sources of equal name would overwrite: {names}.")
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
            path.parent.mkdir(parents=True, exist_ok=True)
            reference.save(path)
            assert reference.report is not None  # make_reference always evaluates
            rows.append({**reference.report.summary(), **_speed(reference)})
            if not self.json:
                _show(f"{demonstration.name} → {robot.title}: {path}", rows[-1], False)
        if self.json:
            print(json.dumps(rows if several else rows[0], allow_nan=False))
        if failed:
            raise OmniEnvsError("; ".join(failed))


@dataclass
class Evaluate:
    """Metrics of references, ours or a peer's."""

    references: tyro.conf.Positional[tuple[Path, ...]]
    """Reference files, or robot motions of OmniRetarget's dataset and holosoma (.npz)."""

    source: str | None = None
    """What a peer's motion was made from: a demonstration file or the name of a built-in one. Our
    own references carry it."""

    robot: str = "g1"
    """Robot of a peer's motion."""

    object: Path | None = None
    """Mesh of the object, where the source does not carry it."""

    terrain: Path | None = None
    """Mesh of the terrain at human scale, where it does not lie beside the source."""

    height: float | None = None
    """Standing height of the human in metres, where the source does not tell it."""

    picture: Path | None = None
    """Draw the report of a single reference on a page (.png, .pdf or .svg)."""

    details: bool = False
    """Print every figure, not only the headlines."""

    json: bool = False
    """Print JSON: one object per file, in a list if there are several files."""

    def run(self) -> None:  # noqa: D102
        from dataclasses import replace

        from omni_envs.demonstrations import load_demonstration
        from omni_envs.errors import InvalidOptionError
        from omni_envs.references import evaluate_reference, open_reference, report_picture

        if self.picture is not None and len(self.references) != 1:
            raise InvalidOptionError("--picture: draws one reference; give a single file.")
        demonstration = None
        if self.source is not None:
            demonstration = load_demonstration(
                self.source, object_mesh=self.object, terrain_mesh=self.terrain, height=self.height
            )
        rows = []
        for path in self.references:
            reference = open_reference(path, self.robot, demonstration)
            report = evaluate_reference(reference)
            if self.picture is not None:
                report_picture(replace(reference, report=report), self.picture)
            rows.append(report.details() if self.details else report.summary())
            if not self.json:
                _show(str(path), rows[-1], False)
        if self.json:
            print(json.dumps(rows[0] if len(rows) == 1 else rows, allow_nan=False))


@dataclass
class View:
    """Look at a reference."""

    reference: tyro.conf.Positional[Path]
    """A reference file."""

    strip: Path | None = None
    """Write a strip of pictures (.png)."""

    video: Path | None = None
    """Write a video (.mp4 or .gif)."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.errors import InvalidOptionError
        from omni_envs.references import Reference
        from omni_envs.viewer import reference_strip, reference_video

        if self.strip is None and self.video is None:
            raise InvalidOptionError("omni-envs view: give --strip PNG, --video MP4, or both.")
        reference = Reference.load(self.reference)
        paths = []
        if self.strip is not None:
            paths.append(reference_strip(reference, self.strip))
        if self.video is not None:
            paths.append(reference_video(reference, self.video))
        if self.json:
            print(json.dumps({"path": [str(p) for p in paths]}))
        else:
            for path in paths:
                _console.print(f"wrote {path}")


@dataclass
class BenchStep:
    """Speed of stepping an environment beside the raw physics of the same model."""

    env: str = "OmniEnvs/G1BoxCarry-v0"
    """Environment id."""

    num_envs: int = 64
    """Simulations."""

    num_threads: int = 0
    """Physics threads; 0 takes every core."""

    reference: Path | None = None
    """A reference file instead of the built-in one."""

    seconds: float = 10.0
    """Time to measure, split between the two."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.benchmarks.step import bench_step

        rows = bench_step(
            self.env,
            num_envs=self.num_envs,
            num_threads=self.num_threads,
            reference=self.reference,
            seconds=self.seconds,
        )
        _show(f"{self.env}, {self.num_envs} environments", rows, self.json)


@dataclass
class BenchRetarget:
    """Speed of retargeting, cold and with the interaction mesh at hand."""

    source: tyro.conf.Positional[str] = "box_carry"
    """A demonstration file, or the name of a built-in demonstration."""

    robot: str = "g1"
    """Name of the robot."""

    repeats: int = 3
    """Runs; the median counts."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.benchmarks.retarget import bench_retarget

        rows = bench_retarget(self.source, robot=self.robot, repeats=self.repeats)
        _show(f"retargeting {self.source} to {self.robot}, one thread", rows, self.json)


@dataclass
class Bench:
    """Figures of speed, ratios measured in the same run."""

    what: (
        Annotated[BenchStep, tyro.conf.subcommand("step")]
        | Annotated[BenchRetarget, tyro.conf.subcommand("retarget")]
    )

    def run(self) -> None:  # noqa: D102
        self.what.run()


@dataclass
class Export:
    """A trained run → a policy file for a deploy stack."""

    run_dir: tyro.conf.Positional[Path]
    """Run directory written by train.py."""

    profile: Literal["beyondmimic"] = "beyondmimic"
    """Convention of the file."""

    out: Path | None = None
    """Where the file goes; RUN/policy.onnx by default."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.export import export_run

        rows = export_run(self.run_dir, profile=self.profile, out=self.out)
        _show(f"{self.run_dir} → {rows['path']}", rows, self.json)


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
        _show("What the demo made", rows, self.json)


Command = (
    Annotated[List, tyro.conf.subcommand("list")]
    | Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Retarget, tyro.conf.subcommand("retarget")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[View, tyro.conf.subcommand("view")]
    | Annotated[Bench, tyro.conf.subcommand("bench")]
    | Annotated[Export, tyro.conf.subcommand("export")]
)


def _speed(reference: Any) -> dict[str, float]:
    seconds = float(reference.provenance["solve_seconds"])
    frames = int(reference.provenance["solved_frames"])
    return {"solve_seconds": seconds, "frames_per_s": frames / seconds}


def _check_suffix(path: Path, suffix: str) -> None:
    from omni_envs.errors import InvalidOptionError

    if path.suffix != suffix:
        raise InvalidOptionError(f"--out {path}: must end in {suffix}; got {path.suffix!r}.")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command line.

    Args:
        arguments: Words after the command's name; ``sys.argv`` by default.

    Returns:
        Exit status: 0 done, 1 could not do what was asked, 2 wrong usage (raised by the parser).
    """
    command = tyro.cli(
        Command,
        prog="omni-envs",
        args=arguments,
        config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
    )
    try:
        command.run()
    except OmniEnvsError as error:
        print(f"omni-envs: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("omni-envs: interrupted", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
