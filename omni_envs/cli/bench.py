"""``omni-envs bench``: one class per benchmark."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from omni_envs.cli.output import show


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
        show(f"{self.env}, {self.num_envs} environments", rows, self.json)


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
class Bench:
    """Figures of speed, ratios measured in the same run."""

    what: (
        Annotated[BenchStep, tyro.conf.subcommand("step")]
        | Annotated[BenchRetarget, tyro.conf.subcommand("retarget")]
    )

    def run(self) -> None:  # noqa: D102
        self.what.run()
