"""``omni-envs bench``: one class per benchmark."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from rich.table import Table

from omni_envs.cli.output import console, show


@dataclass
class BenchStep:
    """Speed of stepping, beside raw physics, Gymnasium's Humanoid-v5 and AsyncVectorEnv."""

    env: str = "OmniEnvs/G1BoxCarry-v0"
    """Environment id."""

    num_envs: tuple[int, ...] = (64, 256)
    """Sizes of the vector environment."""

    num_threads: tuple[int, ...] = (1, 0)
    """Numbers of physics threads; 0 takes every core."""

    reference: Path | None = None
    """A reference file instead of the built-in one."""

    physics: Literal["default", "fast"] = "default"
    """4 physics steps of 5 ms per control step, or 2 of 10 ms."""

    seconds: float = 5.0
    """Time to measure per row."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.benchmarks.environments import bench_environments

        figures = bench_environments(
            self.env,
            self.num_envs,
            self.num_threads,
            seconds=self.seconds,
            reference=self.reference,
            physics=self.physics,
        )
        if self.json:
            show(self.env, figures, as_json=True)
        else:
            _show_environments(self.env, figures)


@dataclass
class BenchSoak:
    """Many steps under random and adversarial actions: NaN, memory, divergences."""

    env: str = "OmniEnvs/G1BoxCarry-v0"
    """Environment id."""

    steps: int = 10_000_000
    """Physics steps of all simulations together."""

    num_envs: int = 256
    """Simulations."""

    num_threads: int = 0
    """Physics threads; 0 takes every core."""

    seed: int = 0
    """Seed of environment and actions."""

    reference: Path | None = None
    """A reference file instead of the built-in one."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.benchmarks.soak import bench_soak

        rows = bench_soak(
            self.env,
            self.steps,
            num_envs=self.num_envs,
            num_threads=self.num_threads,
            seed=self.seed,
            reference=self.reference,
            progress=sys.stderr.isatty(),
        )
        show(f"{self.env} under random and adversarial actions", rows, self.json)


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
        show(f"retargeting {self.source} to {self.robot}, one thread", rows, self.json)


@dataclass
class BenchParallel:
    """Speed of many references over processes beside one process, start-up included."""

    sources: tyro.conf.Positional[tuple[str, ...]] = ("box_carry",)
    """Demonstration files, or names of built-in demonstrations."""

    robot: str = "g1"
    """Name of the robot."""

    jobs: int = 2
    """Processes to compare with one."""

    items: int = 12
    """References in the batch: the sources in turn, each again at another pace."""

    repeats: int = 1
    """Runs; the median counts."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.benchmarks.parallel import bench_parallel

        rows = bench_parallel(
            self.sources,
            robot=self.robot,
            jobs=self.jobs,
            items=self.items,
            repeats=self.repeats,
        )
        show(f"{self.items} references over {self.jobs} processes", rows, self.json)


@dataclass
class Bench:
    """Figures of speed, ratios measured in the same run."""

    what: (
        Annotated[BenchStep, tyro.conf.subcommand("step")]
        | Annotated[BenchSoak, tyro.conf.subcommand("soak")]
        | Annotated[BenchRetarget, tyro.conf.subcommand("retarget")]
        | Annotated[BenchParallel, tyro.conf.subcommand("parallel")]
    )

    def run(self) -> None:  # noqa: D102
        self.what.run()


def _show_environments(env: str, figures: dict[str, Any]) -> None:
    table = Table(title=f"{env}, control steps per second", title_justify="left")
    table.add_column("what")
    for column in ("steps/s", "beside", "ratio"):
        table.add_column(column, justify="right")

    def row(what: str, ours: float, beside: float, ratio: float) -> None:
        table.add_row(what, f"{ours:.0f}", f"{beside:.0f}", f"{ratio:.3f}")

    def raw(what: str, measured: dict[str, float]) -> None:
        row(what, measured["steps_per_s"], measured["raw_steps_per_s"], measured["ratio"])

    for v in figures["vector"]:
        raw(f"{v['num_envs']} simulations, {v['num_threads']} threads / mujoco.batch", v)
    raw("single environment / mj_step", figures["single"])
    raw("Gymnasium's Humanoid-v5 / mj_step", figures["humanoid"])
    for other in figures["asynchronous"]:
        row(
            f"vector environment / AsyncVectorEnv, {other['workers']} processes",
            other["steps_per_s"],
            other["async_steps_per_s"],
            other["ratio"],
        )
    console.print(table)
    memory = figures["bytes_per_env"]
    count = figures["vector"][-1]["num_envs"]
    console.print(
        f"{count} simulations: made in {figures['construct_seconds']:.2f} s, "
        + ("memory unknown" if memory is None else f"{memory / 1024:.0f} KiB each at the peak")
    )
