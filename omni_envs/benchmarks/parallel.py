"""How much faster many references are made over several processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from omni_envs.demonstrations import Demonstration, load_demonstration
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.progress import ProgressCallback
from omni_envs.references import Reference, make_references
from omni_envs.retargeting import RetargetOptions

_PACES = (1.0, 0.85, 0.7, 1.2)
"""Playback speeds that make several items of one demonstration."""

_START_FRAMES = 2


def bench_parallel(
    sources: Sequence[str | Path | Demonstration] = ("box_carry",),
    *,
    robot: str = "g1",
    jobs: int = 2,
    items: int = 12,
    repeats: int = 1,
    options: RetargetOptions | None = None,
    progress: ProgressCallback | None = None,
) -> dict[str, Any]:
    """Makes the same batch of references in one process and in several, one after the other.

    The batch goes round the sources; each comes again at another pace. Start-up counts: every
    figure is that of a whole call of ``make_references``, by the clock.

    Args:
        sources: Demonstrations, their files, or names of built-in ones.
        robot: Name of the robot.
        jobs: Processes to compare with one.
        items: References in the batch.
        repeats: How often to measure; medians count.
        options: Settings of the retargeting.
        progress: Called with (frames done, frames in all) of each call.

    Returns:
        - ``items``, ``frames``, ``jobs``.
        - ``seconds_1``, ``seconds_n`` and ``ratio``, the median of their ratios.
        - ``frames_per_s_1``, ``frames_per_s_n``.
        - ``startup_s``: a batch of one item of two frames per process.
        - ``busy_fraction``: part of the cores' time in ``seconds_n`` that solving takes, by the
          solver's own clock; what is missing is start-up, evaluation and waiting for the last item.

    Raises:
        InvalidOptionError: ``jobs``, ``items`` or ``repeats`` is less than 1, or there is no
            source.
        OmniEnvsError: A demonstration cannot be read or retargeted.
    """
    for name, value in (("jobs", jobs), ("items", items), ("repeats", repeats)):
        if value < 1:
            raise InvalidOptionError(f"bench_parallel: {name} must be at least 1; got {value}.")
    if not sources:
        raise InvalidOptionError("bench_parallel: sources must be at least one demonstration.")
    clips = [s if isinstance(s, Demonstration) else load_demonstration(s) for s in sources]
    batch = [at_pace(clips[i % len(clips)], i // len(clips)) for i in range(items)]

    def run(demonstrations: list[Demonstration], processes: int) -> tuple[float, list[Reference]]:
        start = perf_counter()
        made = make_references(
            demonstrations, robot, options=options, jobs=processes, progress=progress
        )
        seconds = perf_counter() - start
        for reference in made:
            if isinstance(reference, OmniEnvsError):
                raise reference
        return seconds, [r for r in made if isinstance(r, Reference)]

    startup, _ = run([_beginning(batch[0])] * jobs, jobs)
    single, many = np.empty(repeats), np.empty(repeats)
    for i in range(repeats):
        single[i], _ = run(batch, 1)
        many[i], references = run(batch, jobs)
    frames = sum(reference.num_frames for reference in references)
    solving = sum(reference.provenance["solve_seconds"] for reference in references)
    return {
        "items": items,
        "frames": frames,
        "jobs": jobs,
        "seconds_1": float(np.median(single)),
        "seconds_n": float(np.median(many)),
        "ratio": float(np.median(single / many)),
        "frames_per_s_1": frames / float(np.median(single)),
        "frames_per_s_n": frames / float(np.median(many)),
        "startup_s": startup,
        "busy_fraction": solving / (jobs * float(many[-1])),
    }


def at_pace(demonstration: Demonstration, number: int) -> Demonstration:
    """The same motion at one of several playback speeds, none of them twice in a row."""
    pace = _PACES[number % len(_PACES)] * (1.0 + 0.01 * (number // len(_PACES)))
    return replace(
        demonstration, name=f"{demonstration.name}_{number}", fps=pace * demonstration.fps
    )


def _beginning(demonstration: Demonstration) -> Demonstration:
    def cut(array: np.ndarray | None) -> np.ndarray | None:
        return None if array is None else array[:_START_FRAMES]

    return replace(
        demonstration,
        positions=demonstration.positions[:_START_FRAMES],
        orientations=cut(demonstration.orientations),
        object_poses=cut(demonstration.object_poses),
        contacts={k: v[:_START_FRAMES] for k, v in demonstration.contacts.items()},
    )
