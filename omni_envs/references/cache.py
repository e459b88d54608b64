"""References made once: a folder of reference files under the hash of everything they depend on."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock
from platformdirs import user_cache_path

import omni_envs
from omni_envs.demonstrations import Demonstration
from omni_envs.errors import FileFormatError, OmniEnvsError
from omni_envs.progress import ProgressCallback
from omni_envs.references.archive import FORMAT
from omni_envs.references.build import make_reference, versions
from omni_envs.references.npz import digest
from omni_envs.references.reference import Reference
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import Robot, get_robot

VARIABLE = "OMNI_ENVS_CACHE"
"""Environment variable that names the cache folder."""

# What a reference is made by: a change of this code makes cached references stale.
_ROOMS = ("robots", "scenes", "demonstrations", "retargeting", "metrics", "references")
_MODULES = ("rotations.py", "resampling.py")


def cache_folder() -> Path:
    """Returns the folder of the cache: ``OMNI_ENVS_CACHE``, else the user's cache directory."""
    named = os.environ.get(VARIABLE)
    return Path(named).expanduser() if named else user_cache_path("omni_envs", appauthor=False)


def cached_reference(
    demonstration: Demonstration,
    robot: str | Robot,
    *,
    fps: float = 50.0,
    options: RetargetOptions | None = None,
    progress: ProgressCallback | None = None,
) -> Reference:
    """Returns the reference of a demonstration, made at most once per machine.

    Safe under any number of processes: one of them makes the reference while the others wait. An
    entry is either complete or absent; one that is damaged is made again, with a warning.

    Args:
        demonstration: The human motion.
        robot: The robot or its name.
        fps: Frames per second of the reference.
        options: Settings of the retargeter.
        progress: Called with (frames done, frames in all) while retargeting, if that is needed.

    Raises:
        OmniEnvsError: The folder cannot be written to.
    """
    robot, options = get_robot(robot), options or RetargetOptions()
    key = reference_key(demonstration, robot, fps, options)
    slug = re.sub(r"[^A-Za-z0-9_-]+", "-", demonstration.name)[:40]
    path = cache_folder() / "references" / f"{slug}-{robot.name}-{key[:24]}.npz"
    found = _read(path, key)
    if found is not None:
        return found
    lock = FileLock(path.with_suffix(".lock"))
    with _writing(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    try:
        found = _read(path, key, warn=True)
        if found is None:
            found = make_reference(
                demonstration, robot, fps=fps, options=options, progress=progress
            )
            found = dataclasses.replace(found, provenance={**found.provenance, "key": key})
            with _writing(path.parent):
                for leftover in path.parent.glob(f".{path.name}.*.tmp"):
                    leftover.unlink()  # of a writer that was killed: only the lock's holder writes
                found.save(path)
    finally:
        lock.release()
    return found


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OmniEnvsError(
            f"The cache folder {folder} cannot be written to ({error.strerror or error}); "
            f"name another one in {VARIABLE}."
        ) from error


def reference_key(
    demonstration: Demonstration, robot: Robot, fps: float, options: RetargetOptions
) -> str:
    """Returns the hash of all that a reference depends on, code and versions included."""
    arrays: dict[str, np.ndarray] = {}
    facts = {
        "demonstration": _facts(demonstration, "demonstration", arrays),
        "robot": _facts(robot, "robot", arrays),
        "options": _facts(options, "options", arrays),
        "fps": float(fps),
        "format": FORMAT,
        "versions": versions(),
        "code": _code(),
    }
    arrays["facts"] = np.array(json.dumps(facts, sort_keys=True))
    return digest(arrays)


def _facts(value: Any, name: str, arrays: dict[str, np.ndarray]) -> Any:
    """JSON-compatible content of a value; arrays go to ``arrays`` under their place."""
    if isinstance(value, np.ndarray):
        arrays[name] = value
        return None
    if isinstance(value, Path):
        return value.read_text()  # the robot's MJCF: its content counts, not its place
    if dataclasses.is_dataclass(value):
        parts = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return {k: _facts(v, f"{name}.{k}", arrays) for k, v in parts.items()}
    if hasattr(value, "items"):
        return {str(k): _facts(v, f"{name}.{k}", arrays) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_facts(v, f"{name}.{i}", arrays) for i, v in enumerate(value)]
    if isinstance(value, np.generic):
        return value.item()
    return value


@cache
def _code() -> str:
    sha = hashlib.sha256()
    package = Path(omni_envs.__file__).parent
    files = [
        *(package / m for m in _MODULES),
        *(f for r in _ROOMS for f in (package / r).rglob("*.py")),
    ]
    for path in sorted(files):
        sha.update(path.relative_to(package).as_posix().encode())
        sha.update(path.read_bytes())
    return sha.hexdigest()


def _read(path: Path, key: str, warn: bool = False) -> Reference | None:
    if not path.exists():
        return None
    try:
        reference = Reference.load(path)
    except FileFormatError as error:
        if warn:
            warnings.warn(f"Damaged cache entry, made again: {error}", stacklevel=4)
        return None
    return reference if reference.provenance.get("key") == key else None
