"""From a recipe to a dataset, resumable and in shards."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.generation.card import write_card
from omni_envs.generation.engines import ENGINES
from omni_envs.generation.item import DONE, Item, named_demonstration
from omni_envs.generation.manifest import Manifest, sole_writer
from omni_envs.generation.recipe import Recipe, SourceEntry
from omni_envs.progress import ProgressCallback
from omni_envs.references import reference_key
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import get_robot


def generate(
    recipe: Recipe,
    out: str | Path,
    *,
    jobs: int | None = None,
    engine: str = "local",
    shard: tuple[int, int] = (1, 1),
    previews: int = 12,
    progress: ProgressCallback | None = None,
) -> dict[str, Any]:
    """Makes what a recipe asks for and is not there yet.

    Killed at any moment and started again, it goes on without losing or repeating an item. Failed
    items are tried again.

    Args:
        recipe: What to make.
        out: Folder of the dataset.
        jobs: Workers; one per core by default.
        engine: ``"local"`` or ``"ray"``.
        shard: (i, n): make the i-th of n equal parts, from 1.
        previews: Most pictures of the dataset card.
        progress: Called with (frames done, frames in all), items that were there not counted.

    Returns:
        Figures: items, made, kept, failed, frames, and the names of the failed.

    Raises:
        InvalidOptionError: An option that is not allowed.
        OmniEnvsError: Two sources of one name, another process that makes the same part, or a
            worker that died.
    """
    out = Path(out)
    jobs = (os.cpu_count() or 1) if jobs is None else jobs
    if jobs < 1:
        raise InvalidOptionError(f"jobs must be at least 1; got {jobs}.")
    if engine not in ENGINES:
        raise InvalidOptionError(f"engine: expected one of {', '.join(ENGINES)}; got {engine!r}.")
    number, count = shard
    if not 1 <= number <= count:
        raise InvalidOptionError(f"shard: expected i/n with 1 ≤ i ≤ n; got {number}/{count}.")
    with sole_writer(out, shard):
        manifest = Manifest(out, shard)
        items, broken = plan(recipe)
        mine = items[number - 1 :: count]
        todo = [item for item in mine if not manifest.is_done(item)]
        if number == 1:
            for row in broken:
                manifest.add(row)
        total, done = sum(item.frames for item in todo), 0
        if todo:
            # Unvaried first, as the others are anchored to them; then the long ones.
            order = sorted(todo, key=lambda i: (not i.name.endswith("/nominal"), -i.frames))
            for row in ENGINES[engine](order, str(out), jobs):
                manifest.add(row)
                done += int(row["frames"])
                if progress is not None:
                    progress(done, total)
        manifest.tidy()
        # What once failed and is no longer asked for is no news.
        asked = {item.name for item in items} | {row["name"] for row in broken}
        rows = [r for r in manifest.rows.values() if r["status"] == DONE or r["name"] in asked]
        write_card(out, rows, previews=previews)
        failed = [r["name"] for r in _of(manifest, mine) if r["status"] != DONE]
        failed += [row["name"] for row in broken]
        return {
            "items": len(mine) + len(broken),
            "made": len(todo),
            "kept": len(mine) - len(todo),
            "failed": len(failed),
            "frames": total,
            "failed_names": failed,
        }


def plan(recipe: Recipe) -> tuple[list[Item], list[dict[str, Any]]]:
    """Returns all items of a recipe, and rows of the sources that cannot be read.

    Raises:
        OmniEnvsError: Two sources of one name.
    """
    items: list[Item] = []
    broken: list[dict[str, Any]] = []
    for entry in recipe.sources:
        try:
            items += _items(entry, recipe)
        except OmniEnvsError as error:
            row = {"name": entry.demonstration, "key": "", "frames": 0, "seconds": 0.0}
            broken.append(row | {"status": "failed", "message": str(error)})
    made: dict[str, Item] = {}
    for item in items:
        other = made.setdefault(item.name, item)
        if other is not item:
            sources = " and ".join(dict.fromkeys((other.demonstration, item.demonstration)))
            raise OmniEnvsError(
                f"The recipe makes {item.name!r} twice, from {sources}. Sources of one name need a "
                "`name` of their own."
            )
    return items, broken


def _items(entry: SourceEntry, recipe: Recipe) -> list[Item]:
    words = json.dumps(dict(entry.options))
    demonstration = named_demonstration(entry.demonstration, words, entry.name)
    frames = int((demonstration.num_frames - 1) * recipe.fps / demonstration.fps) + 1
    options = RetargetOptions(refine=recipe.refine)
    return [
        Item(
            name=f"{demonstration.name}/{robot}/{variation.name}",
            demonstration=entry.demonstration,
            options=words,
            robot=robot,
            variation=variation,
            fps=recipe.fps,
            refine=recipe.refine,
            frames=frames,
            key=reference_key(demonstration, get_robot(robot), recipe.fps, options, variation),
            title=entry.name,
        )
        for robot in entry.robots
        for variation in entry.variations
    ]


def _of(manifest: Manifest, items: Iterable[Item]) -> list[dict[str, Any]]:
    return [manifest.rows[item.name] for item in items if item.name in manifest.rows]
