"""One reference of a dataset: what it is, and the function that every engine runs to make it."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from omni_envs.demonstrations import Demonstration, Variation, load_demonstration
from omni_envs.errors import OmniEnvsError
from omni_envs.references import cached_reference, make_reference
from omni_envs.retargeting import RetargetOptions

DONE, FAILED = "done", "failed"
"""Values of ``status``."""


@dataclass(frozen=True)
class Item:
    """One reference to make. It travels to other processes and machines, so it names its source.

    Attributes:
        name: ``demonstration/robot/variation``.
        demonstration: A built-in name or a file.
        options: Further arguments of ``load_demonstration``, as JSON.
        robot: Name of the robot.
        variation: The scene.
        fps: Frames per second.
        refine: Refine the whole clip.
        frames: How many frames it will have.
        key: Hash of all that it depends on.
        title: What the demonstration is called, instead of after its file.
    """

    name: str
    demonstration: str
    options: str
    robot: str
    variation: Variation
    fps: float
    refine: bool
    frames: int
    key: str
    title: str | None = None

    @property
    def file(self) -> str:
        """Where it goes, relative to the dataset."""
        return f"{self.name}.npz"


def make_item(item: Item, out: str) -> dict[str, Any]:
    """Makes a reference and writes it; errors become part of the row that is returned.

    Args:
        item: What to make.
        out: Folder of the dataset.

    Returns:
        JSON-compatible facts: name, status, file, key, hash, figures, times.
    """
    start, cpu = time.perf_counter(), time.process_time()
    row: dict[str, Any] = {"name": item.name, "key": item.key, "frames": item.frames}
    try:
        demonstration = named_demonstration(item.demonstration, item.options, item.title)
        options = RetargetOptions(refine=item.refine)
        settings: Mapping[str, Any] = {"fps": item.fps, "options": options}
        if item.variation == Variation():
            reference = cached_reference(demonstration, item.robot, **settings)
        else:
            reference = make_reference(
                demonstration,
                item.robot,
                variation=item.variation,
                nominal=cached_reference(demonstration, item.robot, **settings),
                **settings,
            )
        path = reference.save(Path(out) / item.file)
        assert reference.report is not None  # make_reference always evaluates
        row |= {
            "status": DONE,
            "file": item.file,
            "sha256": file_hash(path),
            "duration_s": reference.duration,
            "source": reference.provenance["source"],
            "licence": reference.provenance["licence"],
            "summary": reference.report.summary(),
        }
    except OmniEnvsError as error:
        row |= {"status": FAILED, "message": str(error)}
    except Exception as error:  # one broken clip must not end a night's work
        row |= {"status": FAILED, "message": f"{type(error).__name__}: {error}"}
    seconds = {"seconds": time.perf_counter() - start, "cpu_seconds": time.process_time() - cpu}
    return row | seconds


def file_hash(path: Path) -> str:
    """Returns the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@lru_cache(maxsize=4)
def named_demonstration(name: str, options: str, title: str | None) -> Demonstration:
    """Loads a demonstration and gives it the name that it has in the recipe."""
    demonstration = load_demonstration(name, **json.loads(options))
    return demonstration if title is None else replace(demonstration, name=title)
