"""One door for every demonstration: a file of a known format, or a built-in name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from omni_envs.demonstrations.accad import load_accad
from omni_envs.demonstrations.builtin import builtin_demonstration, builtin_names
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.intermimic import load_intermimic
from omni_envs.demonstrations.mocap import load_mocap
from omni_envs.errors import FileFormatError, InvalidOptionError, UnknownNameError

SUFFIXES = (".bvh", ".npy", ".pt")
"""File name endings that ``load_demonstration`` reads."""


def load_demonstration(
    path_or_name: str | Path,
    *,
    object_mesh: str | Path | None = None,
    terrain_mesh: str | Path | None = None,
    height: float | None = None,
) -> Demonstration:
    """Loads a demonstration.

    Args:
        path_or_name: Name of a built-in demonstration, an InterMimic ``.pt`` file, a climbing mocap
            ``.npy`` file, or a ``.bvh`` file with the ACCAD skeleton.
        object_mesh: Mesh of the object, for formats with an object.
        terrain_mesh: Mesh of the terrain at human scale, for formats without an object.
        height: Standing height of the person, m; None takes what the source says.

    Raises:
        UnknownNameError: Neither a built-in name nor a file.
        FileFormatError: The file cannot be used; the message says which part and why.
        InvalidOptionError: An option that this source does not take, or a height that is not
            positive.
    """
    if height is not None and not 0 < height < 3:
        raise InvalidOptionError(f"height must be between 0 and 3 m; got {height}.")
    given = {"object_mesh": object_mesh, "terrain_mesh": terrain_mesh, "height": height}
    if str(path_or_name) in builtin_names():
        _refuse(given, f"built-in demonstration {path_or_name!r}", ())
        return builtin_demonstration(str(path_or_name))
    path = Path(path_or_name)
    suffix = path.suffix.lower()
    if not suffix and not path.exists():
        raise UnknownNameError("demonstration", str(path_or_name), builtin_names())
    if suffix == ".pt":
        _refuse(given, f"InterMimic file {path.name}", ("object_mesh", "height"))
        return load_intermimic(path, object_mesh=object_mesh, height=height)
    if suffix == ".npy":
        _refuse(given, f"mocap file {path.name}", ("terrain_mesh", "height"))
        return load_mocap(path, terrain_mesh=terrain_mesh, height=height)
    if suffix == ".bvh":
        _refuse(given, f"BVH file {path.name}", ("height",))
        return load_accad(path, height=height)
    raise FileFormatError(path, "file name", f"one that ends in {', '.join(SUFFIXES)}", path.name)


def _refuse(given: Mapping[str, object], source: str, taken: tuple[str, ...]) -> None:
    for option, value in given.items():
        if value is not None and option not in taken:
            takes = f"takes {', '.join(taken)}" if taken else "takes no options"
            raise InvalidOptionError(f"{option} does not apply to {source}, which {takes}.")
