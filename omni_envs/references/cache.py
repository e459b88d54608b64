"""References made once: a folder of reference files under the hash of everything they depend on."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock
from platformdirs import user_cache_path

from omni_envs.demonstrations import Demonstration
from omni_envs.errors import FileFormatError, OmniEnvsError
from omni_envs.progress import ProgressCallback
from omni_envs.references.build import make_reference
from omni_envs.references.key import reference_key
from omni_envs.references.reference import Reference
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import Robot, get_robot

VARIABLE = "OMNI_ENVS_CACHE"
"""Environment variable that names the cache folder."""


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
