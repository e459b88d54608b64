"""What a dataset is made from, as a YAML file.

    robots: [g1, h1]
    sources:
      - demonstration: box_carry          # a built-in name, a file or a glob beside the recipe
        variations: poses                 # nothing, poses, heights, or a list of their fields
      - demonstration: clips/*.bvh
        options: {height: 1.7}            # as ``load_demonstration`` takes them
        grid: {terrain_height: [0.9, 1.1]}
        sample: {count: 10, seed: 0, ranges: {terrain_depth: [0.9, 1.2]}}
      - demonstration: subjects/*/walk.bvh   # called S1_walk, S2_walk, …: by what the glob finds
      - demonstration: long.bvh
        name: the_end                     # else a file is called after itself
        options: {start: 60.0}

Every source is also made without a variation: the others are anchored to that.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from reprlib import repr as shown
from typing import Any

from omni_envs.demonstrations import (
    SourceOptions,
    Variation,
    builtin_names,
    load_demonstration,
)
from omni_envs.demonstrations.yaml_file import read_yaml
from omni_envs.errors import FileFormatError, InvalidValueError, UnknownNameError
from omni_envs.generation.recipe_fields import check_fields
from omni_envs.generation.recipe_variations import read_variations
from omni_envs.references.formats.motion import RATES, is_rate
from omni_envs.robots import get_robot

_TOP = ("robots", "sources", "fps", "refine")
_SOURCE = ("demonstration", "name", "options", "robots", "variations", "grid", "sample")
_OPTIONS = tuple(inspect.signature(load_demonstration).parameters)[1:]
_FILES = ("object_mesh", "terrain_mesh", "body_model", "skeleton")
_WILD = re.compile(r"[*?\[]")


@dataclass(frozen=True)
class SourceEntry:
    """One demonstration and what is made of it.

    Attributes:
        demonstration: A built-in name or a file.
        robots: Names of robots.
        options: Further arguments of ``load_demonstration``.
        variations: The scenes, the unchanged one first.
        name: What it is called, instead of after its file.
    """

    demonstration: str
    robots: tuple[str, ...]
    options: Mapping[str, Any] = field(default_factory=dict)
    variations: tuple[Variation, ...] = (Variation(),)
    name: str | None = None


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
    data = read_yaml(path, 16 << 20)
    check_fields(path, "recipe", data, _TOP, ("robots", "sources"))
    robots = _robots(path, "robots", data["robots"])
    if not isinstance(data["sources"], list) or not data["sources"]:
        expected = "a list of at least one source"
        raise FileFormatError(path, "sources", expected, shown(data["sources"]))
    entries: list[SourceEntry] = []
    for number, source in enumerate(data["sources"]):
        entries += _entries(path, f"sources[{number}]", source, robots)
    fps, refine = data.get("fps", 50.0), data.get("refine", True)
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not is_rate(fps):
        raise FileFormatError(path, "fps", RATES, shown(fps))
    if not isinstance(refine, bool):
        raise FileFormatError(path, "refine", "true or false", shown(refine))
    return Recipe(tuple(entries), float(fps), refine)


def _entries(path: Path, place: str, source: Any, robots: tuple[str, ...]) -> list[SourceEntry]:
    check_fields(path, place, source, _SOURCE, ("demonstration",))
    if "robots" in source:
        robots = _robots(path, f"{place}.robots", source["robots"])
    options = _options(path, f"{place}.options", source.get("options", {}))
    variations = read_variations(path, place, source)
    files = _files(path, f"{place}.demonstration", source["demonstration"])
    if "name" in source:
        name = source["name"]
        # It becomes the name of a folder, on any system.
        if not isinstance(name, str) or not re.fullmatch(r"\w[\w .+-]{0,99}(?<![ .])", name):
            expected = "letters, digits and any of _ . + - and blanks between them"
            raise FileFormatError(path, f"{place}.name", expected, shown(name))
        if len(files) > 1:
            found = f"{len(files)} files"
            raise FileFormatError(path, f"{place}.name", "given for a single file", found)
        files = [(files[0][0], name)]
    return [SourceEntry(file, robots, options, variations, called) for file, called in files]


def _files(path: Path, place: str, pattern: Any) -> list[tuple[str, str | None]]:
    """Files that a pattern finds, and their names where they are not called after themselves."""
    if not isinstance(pattern, str):
        raise FileFormatError(path, place, "a name, file or glob", shown(pattern))
    if pattern in builtin_names():
        return [(pattern, None)]
    found: list[tuple[str, str | None]] = []
    try:
        wanted = path.parent.resolve() / Path(pattern).expanduser()
        if wanted.is_file():  # whatever brackets its name has
            return [_file(wanted, (wanted.stem,))]
        root = Path(wanted.anchor)
        inner = wanted.relative_to(root)
        first = next((i for i, part in enumerate(inner.parts) if _WILD.search(part)), None)
        found += [
            _file(file, file.relative_to(root).with_suffix("").parts[first:])
            for file in (sorted(root.glob(str(inner))) if first is not None else ())
            if file.is_file()
        ]
    except (ValueError, NotImplementedError, OSError, RuntimeError):  # no pattern at all
        pass
    if not found:
        valid = f"a file beside the recipe, or one of {', '.join(builtin_names())}"
        raise FileFormatError(path, place, valid, repr(pattern))
    return found


def _file(file: Path, parts: tuple[str, ...]) -> tuple[str, str | None]:
    """Where a file is, past links, beside its meshes; and its name, where that is not its own."""
    there, name = file.resolve(), "_".join(parts)
    return str(there), None if name == there.stem else name


def _options(path: Path, place: str, given: Any) -> dict[str, Any]:
    """Arguments of ``load_demonstration``, files among them found beside the recipe."""
    check_fields(path, place, given, _OPTIONS)
    options = {name: value for name, value in given.items() if value is not None}
    for name in _FILES:
        if name not in options:
            continue
        value = options[name]
        if not isinstance(value, str):
            raise FileFormatError(path, f"{place}.{name}", "the name of a file", shown(value))
        file = (path.parent / Path(value).expanduser()).resolve()
        if name != "skeleton" or file.is_file():  # skeletons have names, too
            options[name] = str(file)
    own = {f.name for f in fields(SourceOptions)}
    try:
        SourceOptions(**{name: value for name, value in options.items() if name in own})
    except InvalidValueError as error:
        field = f"{place}.{error.option}"
        raise FileFormatError(path, field, error.expected, error.found) from error
    return options


def _robots(path: Path, place: str, names: Any) -> tuple[str, ...]:
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise FileFormatError(path, place, "a list of robot names", shown(names))
    try:
        robots = tuple(get_robot(name).name for name in names)
    except UnknownNameError as error:
        expected = f"some of {', '.join(error.valid)}"
        raise FileFormatError(path, place, expected, repr(error.name)) from error
    if len(set(robots)) < len(robots):
        raise FileFormatError(path, place, "every robot once", shown(names))
    return robots
