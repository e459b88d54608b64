"""The hash of everything that a reference depends on."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import omni_envs
from omni_envs.demonstrations import Demonstration
from omni_envs.demonstrations.variation import Variation
from omni_envs.references.archive import FORMAT
from omni_envs.references.npz import digest
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import Robot

# The code that makes references: where it changes, references made before are stale.
_ROOMS = ("robots", "scenes", "demonstrations", "retargeting", "metrics", "references")
_MODULES = ("rotations.py", "resampling.py")


def versions() -> dict[str, str]:
    """Returns the versions that a reference depends on."""
    return {"omni_envs": omni_envs.__version__, "mujoco": mujoco.__version__, "format": FORMAT}


def content_hashes(
    demonstration: Demonstration,
    robot: Robot,
    fps: float,
    options: RetargetOptions,
    variation: Variation | None = None,
) -> dict[str, str]:
    """Returns the SHA-256 of demonstration, scene, robot, settings, variation and code."""
    return {
        "demonstration": _hash(demonstration),
        "scene": _hash(demonstration.scene),
        "robot": _hash(robot),
        "settings": _hash({"options": options, "fps": float(fps), "versions": versions()}),
        "variation": _hash(variation or Variation()),
        "code": _code(),
    }


def reference_key(
    demonstration: Demonstration,
    robot: Robot,
    fps: float,
    options: RetargetOptions,
    variation: Variation | None = None,
) -> str:
    """Returns one hash of all that a reference depends on, code and versions included."""
    hashes = content_hashes(demonstration, robot, fps, options, variation)
    return hashlib.sha256(json.dumps(hashes, sort_keys=True).encode()).hexdigest()


def _hash(value: Any) -> str:
    arrays: dict[str, np.ndarray] = {}
    facts = _facts(value, "", arrays)
    return digest({**arrays, "facts": np.array(json.dumps(facts, sort_keys=True))})


def _facts(value: Any, name: str, arrays: dict[str, np.ndarray]) -> Any:
    """JSON-compatible content of a value; its arrays go to ``arrays`` under their place."""
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
