"""What a dataset is made from, as a YAML file.

    robots: [g1, h1]
    sources:
      - demonstration: box_carry          # a built-in name, a file or a glob beside the recipe
        variations: poses                 # nothing, poses, heights, or a list of their fields
      - demonstration: clips/*.bvh
        options: {height: 1.7}            # as ``load_demonstration`` takes them
        grid: {terrain_height: [0.9, 1.1]}
        sample: {count: 10, seed: 0, ranges: {terrain_depth: [0.9, 1.2]}}

Every source is also made without a variation: the others are anchored to that.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from omni_envs.demonstrations import (
    Variation,
    builtin_names,
    load_demonstration,
    sample_variations,
    variation_grid,
)
from omni_envs.demonstrations.variation import HEIGHTS, POSES
from omni_envs.errors import FileFormatError, OmniEnvsError
from omni_envs.robots import get_robot

SETS = {"poses": POSES, "heights": HEIGHTS}
"""Named sets of variations."""

_TOP = ("robots", "sources", "fps", "refine")
_SOURCE = ("demonstration", "options", "robots", "variations", "grid", "sample")
_OPTIONS = tuple(inspect.signature(load_demonstration).parameters)[1:]
_FILES = ("object_mesh", "terrain_mesh", "body_model")


@dataclass(frozen=True)
class SourceEntry:
    """One demonstration and what is made of it.

    Attributes:
        demonstration: A built-in name or a file.
        options: Further arguments of ``load_demonstration``.
        robots: Names of robots.
        variations: The scenes, the unchanged one first.
    """

    demonstration: str
    robots: tuple[str, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    variations: tuple[Variation, ...] = (Variation(),)


@dataclass(frozen=True)
class Recipe:
    """What a dataset is made from.

    Attributes:
        sources: The demonstrations.
        fps: Frames per second of the references.
        refine: Refine whole clips.
    """

    sources: tuple[SourceEntry, ...]
    fps: float = 50.0
    refine: bool = True


def read_recipe(path: str | Path) -> Recipe:
    """Reads a recipe; paths in it are relative to it.

    Raises:
        FileFormatError: The file is missing, no YAML, or a field is unknown, missing or wrong.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing .yaml file", "nothing")
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        line = " ".join(str(error).split())[:160]
        raise FileFormatError(path, "file", "YAML", line) from error
    _check_fields(path, "recipe", data, _TOP, ("robots", "sources"))
    robots = _robots(path, "robots", data["robots"])
    if not isinstance(data["sources"], list) or not data["sources"]:
        raise FileFormatError(
            path, "sources", "a list of at least one source", repr(data["sources"])
        )
    entries: list[SourceEntry] = []
    for number, source in enumerate(data["sources"]):
        entries += _entries(path, f"sources[{number}]", source, robots)
    fps, refine = data.get("fps", 50.0), data.get("refine", True)
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 0 < fps < 1e4:
        raise FileFormatError(path, "fps", "a positive number", repr(fps))
    if not isinstance(refine, bool):
        raise FileFormatError(path, "refine", "true or false", repr(refine))
    return Recipe(tuple(entries), float(fps), refine)


def _entries(path: Path, place: str, source: Any, robots: tuple[str, ...]) -> list[SourceEntry]:
    _check_fields(path, place, source, _SOURCE, ("demonstration",))
    if "robots" in source:
        robots = _robots(path, f"{place}.robots", source["robots"])
    options = source.get("options", {})
    _check_fields(path, f"{place}.options", options, _OPTIONS)
    options = {
        k: str((path.parent / str(v)).resolve()) if k in _FILES else v for k, v in options.items()
    }
    variations = _variations(path, place, source)
    name = source["demonstration"]
    if not isinstance(name, str):
        raise FileFormatError(path, f"{place}.demonstration", "a name, file or glob", repr(name))
    if name in builtin_names():
        files = [name]
    else:
        folder, pattern = path.parent, name
        if Path(name).is_absolute():
            folder, pattern = Path(name).parent, Path(name).name
        try:
            files = [str(p.resolve()) for p in sorted(folder.glob(pattern)) if p.is_file()]
        except (ValueError, NotImplementedError, OSError):  # no pattern at all
            files = []
        if not files:
            valid = f"a file beside the recipe, or one of {', '.join(builtin_names())}"
            raise FileFormatError(path, f"{place}.demonstration", valid, repr(name))
    return [SourceEntry(file, robots, options, variations) for file in files]


def _variations(path: Path, place: str, source: Mapping[str, Any]) -> tuple[Variation, ...]:
    found = [Variation()]
    given = source.get("variations", [])
    try:
        if isinstance(given, str):
            if given not in SETS:
                raise FileFormatError(
                    path, f"{place}.variations", f"a list, or one of {', '.join(SETS)}", repr(given)
                )
            found += SETS[given]
        else:
            if not isinstance(given, list):
                raise FileFormatError(path, f"{place}.variations", "a list", repr(given))
            valid = tuple(f.name for f in fields(Variation))
            for number, values in enumerate(given):
                _check_fields(path, f"{place}.variations[{number}]", values, valid)
                found.append(Variation(**values))
        if "grid" in source:
            _check_fields(path, f"{place}.grid", source["grid"], None)
            found += variation_grid(**source["grid"])
        if "sample" in source:
            sample = source["sample"]
            names = ("count", "ranges", "seed")
            _check_fields(path, f"{place}.sample", sample, names, names[:2])
            count = sample["count"]
            if isinstance(count, bool) or not isinstance(count, int) or count < 1:
                raise FileFormatError(
                    path, f"{place}.sample.count", "a whole number from 1 on", repr(count)
                )
            rng = np.random.default_rng(sample.get("seed", 0))
            found += sample_variations(sample["count"], rng, **sample["ranges"])
    except FileFormatError:
        raise
    except OmniEnvsError as error:
        raise FileFormatError(path, place, "variations", str(error)) from error
    except (TypeError, ValueError) as error:  # words where numbers belong, one where there are two
        said = {key: source[key] for key in ("variations", "grid", "sample") if key in source}
        expected = "variations in numbers (see omni_envs.demonstrations.Variation)"
        raise FileFormatError(path, place, expected, repr(said)[:120]) from error
    return tuple(dict.fromkeys(found))


def _robots(path: Path, place: str, names: Any) -> tuple[str, ...]:
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise FileFormatError(path, place, "a list of robot names", repr(names))
    try:
        return tuple(get_robot(name).name for name in names)
    except OmniEnvsError as error:
        raise FileFormatError(path, place, "names of robots", str(error)) from error


def _check_fields(
    path: Path, place: str, data: Any, valid: tuple[str, ...] | None, needed: tuple[str, ...] = ()
) -> None:
    if not isinstance(data, dict):
        raise FileFormatError(path, place, "a mapping", type(data).__name__)
    for name in data:
        if not isinstance(name, str) or (valid is not None and name not in valid):
            known = "a name" if valid is None else f"one of {', '.join(valid)}"
            raise FileFormatError(path, f"{place}.{name}", known, "an unknown field")
    for name in needed:
        if name not in data:
            raise FileFormatError(path, f"{place}.{name}", "to be there", "no such field")
