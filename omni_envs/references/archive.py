"""References as flat arrays: what stands in a reference file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.metrics.report import ReferenceReport
from omni_envs.references.compact import compact, complete
from omni_envs.references.reference import Reference
from omni_envs.robots import robot_names
from omni_envs.scenes import Scene

FORMAT = "omni_envs.reference/2"
"""Value of the array ``format``: name and version of the layout."""

READABLE = ("omni_envs.reference/1", FORMAT)
"""Formats that can be read. A file of version 1 has the velocities and all body arrays, too."""

_TEXT = ("robot", "name")
_NUMBER = ("fps", "scale")


def reference_to_arrays(reference: Reference) -> dict[str, np.ndarray]:
    """Returns a reference as flat arrays; nested parts have names with a slash."""
    arrays = {"format": np.array(FORMAT)}
    for f in fields(Reference):
        value = getattr(reference, f.name)
        if f.name == "report":
            if value is not None:
                arrays |= {f"report/{k}": v for k, v in value.to_arrays().items()}
        elif f.name == "source":
            if value is not None:
                for part in fields(SourceMotion):
                    _put(arrays, f"source/{part.name}", getattr(value, part.name))
        else:
            _put(arrays, f.name, value)
    return compact(arrays)


def reference_from_arrays(path: str | Path, arrays: Mapping[str, np.ndarray]) -> Reference:
    """Rebuilds a reference from ``reference_to_arrays``.

    Args:
        path: Where the arrays come from, for error messages.
        arrays: Name to array.

    Raises:
        FileFormatError: Arrays are missing, malformed or do not fit the robot.
    """
    _check_format(path, arrays)
    robot = arrays.get("robot")
    if robot is not None and str(robot) not in robot_names():
        raise FileFormatError(path, "robot", f"one of {robot_names()}", repr(str(robot)[:80]))
    arrays = complete(arrays)
    report = {k.removeprefix("report/"): v for k, v in arrays.items() if k.startswith("report/")}
    try:
        values = _take(path, arrays, "", Reference, skip=("report", "source"))
        values["report"] = ReferenceReport.from_arrays(report) if report else None
        has_source = any(k.startswith("source/") for k in arrays)
        values["source"] = (
            SourceMotion(**_take(path, arrays, "source/", SourceMotion)) if has_source else None
        )
        return Reference(**values)
    except InvalidDataError as error:
        raise FileFormatError(path, error.field, "a valid reference", str(error)) from error


def _check_format(path: str | Path, arrays: Mapping[str, np.ndarray]) -> None:
    expected = f"{' or '.join(map(repr, READABLE))} (a file written by Reference.save)"
    if "format" not in arrays:
        found = f"none among the arrays {', '.join(sorted(arrays)[:8])}"
        raise FileFormatError(path, "format", expected, found)
    found = str(arrays["format"])
    if found not in READABLE:
        ours = found.startswith(FORMAT.partition("/")[0] + "/")
        hint = ", which another version of omni_envs writes" if ours else ""
        raise FileFormatError(path, "format", expected, repr(found[:80]) + hint)


def _put(arrays: dict[str, np.ndarray], name: str, value: Any) -> None:
    leaf = name.rpartition("/")[2]
    if value is None:
        return
    if isinstance(value, Scene):
        arrays[name] = np.array(json.dumps(value.to_dict()))
    elif leaf == "provenance":
        arrays[name] = np.array(json.dumps(dict(value), sort_keys=True))
    elif isinstance(value, Mapping):
        arrays |= {f"{name}/{key}": np.asarray(array) for key, array in value.items()}
    else:
        arrays[name] = np.asarray(value)


def _take(
    path: str | Path,
    arrays: Mapping[str, np.ndarray],
    prefix: str,
    cls: type,
    skip: tuple[str, ...] = (),
) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for f in fields(cls):
        if f.name in skip:
            continue
        name = prefix + f.name
        if name in arrays:
            values[f.name] = _decode(path, name, arrays[name])
            continue
        table = {k[len(name) + 1 :]: v for k, v in arrays.items() if k.startswith(f"{name}/")}
        if table or "Mapping" in str(f.type):
            values[f.name] = table
        elif "None" in str(f.type):
            values[f.name] = None
        elif f.default is MISSING and f.default_factory is MISSING:
            raise FileFormatError(path, name, "an array of this name", "none")
    return values


def _decode(path: str | Path, name: str, array: np.ndarray) -> Any:
    leaf = name.rpartition("/")[2]
    try:
        if leaf in ("scene", "original_scene"):
            return Scene.from_dict(json.loads(str(array)))
        if leaf == "provenance":
            return dict(json.loads(str(array)))
        if leaf in _TEXT:
            return str(array)
        if leaf in _NUMBER:
            return float(array)
        if leaf == "body_names":
            return tuple(str(n) for n in array)
        return array
    except (TypeError, ValueError, AttributeError) as error:
        raise FileFormatError(
            path, name, "the value that Reference.save writes", str(error)
        ) from error
