"""The variations that a recipe asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from functools import partial
from math import prod
from pathlib import Path
from reprlib import repr as shown
from typing import Any

import numpy as np

from omni_envs.demonstrations import Variation, sample_variations, variation_grid
from omni_envs.demonstrations.variation import HEIGHTS, POSES
from omni_envs.errors import FileFormatError, InvalidValueError
from omni_envs.generation.recipe_fields import check_fields, check_whole

SETS = {"poses": POSES, "heights": HEIGHTS}
"""Named sets of variations."""

MOST = 100_000
"""Variations that a grid or a sample may have; more is a slip of the pen."""

_FIELDS = tuple(f.name for f in fields(Variation))


def read_variations(path: Path, place: str, source: Mapping[str, Any]) -> tuple[Variation, ...]:
    """Reads what ``variations``, ``grid`` and ``sample`` of a source ask for.

    Args:
        path: The recipe.
        place: Where the source stands in it.
        source: The source.

    Returns:
        The variations, the unchanged scene first.

    Raises:
        FileFormatError: A field is unknown, missing or wrong.
    """
    found = [Variation()]
    given = source.get("variations", [])
    if isinstance(given, str) and given in SETS:
        found += SETS[given]
    elif isinstance(given, list):
        for number, values in enumerate(given):
            here = f"{place}.variations[{number}]"
            check_fields(path, here, values, _FIELDS)
            found += _made(path, here, partial(_one, values))
    else:
        valid = f"a list, or one of {', '.join(SETS)}"
        raise FileFormatError(path, f"{place}.variations", valid, shown(given))
    if "grid" in source:
        grid, here = source["grid"], f"{place}.grid"
        check_fields(path, here, grid, _FIELDS)
        _check_some(path, here, grid)
        count = prod(len(v) for v in grid.values() if isinstance(v, list))
        _check_count(path, here, count)
        found += _made(path, here, lambda: variation_grid(**grid))
    if "sample" in source:
        sample, here = source["sample"], f"{place}.sample"
        names = ("count", "ranges", "seed")
        check_fields(path, here, sample, names, names[:2])
        check_fields(path, f"{here}.ranges", sample["ranges"], _FIELDS)
        _check_some(path, f"{here}.ranges", sample["ranges"])
        count, seed = sample["count"], sample.get("seed", 0)
        check_whole(path, f"{here}.count", count, 1)
        _check_count(path, f"{here}.count", count)
        check_whole(path, f"{here}.seed", seed, 0)
        rng = np.random.default_rng(seed)
        ranges = sample["ranges"]
        found += _made(path, f"{here}.ranges", lambda: sample_variations(count, rng, **ranges))
    return tuple(dict.fromkeys(found))


def _one(values: Mapping[str, Any]) -> list[Variation]:
    return [Variation(**values)]


def _made(path: Path, place: str, make: Callable[[], Iterable[Variation]]) -> list[Variation]:
    """Makes variations; what is wrong with a value is said with its place in the file."""
    try:
        return list(make())
    except InvalidValueError as error:
        field = f"{place}.{error.option}"
        raise FileFormatError(path, field, error.expected, error.found) from error


def _check_count(path: Path, place: str, count: int) -> None:
    if count > MOST:
        raise FileFormatError(path, place, f"at most {MOST} variations", f"{count}")


def _check_some(path: Path, place: str, table: Mapping[str, Any]) -> None:
    if not table:
        raise FileFormatError(path, place, f"at least one of {', '.join(_FIELDS)}", "none")
