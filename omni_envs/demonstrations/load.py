"""One door for every demonstration: a file of a known format, or a built-in name."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import fields
from pathlib import Path

from omni_envs.demonstrations.arrays import map_npy, read_npz_members
from omni_envs.demonstrations.builtin import builtin_demonstration, builtin_names
from omni_envs.demonstrations.bvh_source import load_bvh
from omni_envs.demonstrations.deepmimic import load_deepmimic
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.intermimic import load_intermimic
from omni_envs.demonstrations.joint_arrays import POSITIONS, load_joint_array
from omni_envs.demonstrations.mocap import load_mocap
from omni_envs.demonstrations.omomo import CONVERSION, OBJECT_KEYS, load_omomo
from omni_envs.demonstrations.skeleton import MOCAP
from omni_envs.demonstrations.smpl import load_smpl
from omni_envs.demonstrations.source_options import SourceOptions, Unit, UpAxis
from omni_envs.errors import FileFormatError, InvalidOptionError, UnknownNameError

SUFFIXES = (".bvh", ".npy", ".npz", ".pt", ".txt", ".json")
"""File name endings that ``load_demonstration`` reads."""

_PICKLES = (".p", ".pkl", ".pickle", ".joblib")
_ROBOT = {"qpos", "joint_pos"}  # arrays of robot motions
_OBJECT, _TERRAIN = "object_mesh", "terrain_mesh"
_PART = ("height", "start", "end")
_RATED = (*_PART, "fps")
# What a format is called, and the options that it takes.
_FORMATS: dict[str, tuple[str, tuple[str, ...]]] = {
    ".bvh": ("BVH file", (*_RATED, "up", "unit", "skeleton", _TERRAIN)),
    ".pt": ("InterMimic file", (*_PART, _OBJECT)),
    "mocap": ("mocap file", (*_RATED, _TERRAIN)),
    "smpl": ("SMPL parameter file", (*_RATED, "up", "body_model", _TERRAIN)),
    "omomo": ("OMOMO sequence", (*_RATED, "body_model", _OBJECT)),
    "arrays": ("array file", (*_RATED, "up", "unit", "skeleton", _TERRAIN, _OBJECT)),
    ".txt": ("DeepMimic file", (*_RATED, _TERRAIN)),
    ".json": ("DeepMimic file", (*_RATED, _TERRAIN)),
}


def load_demonstration(
    path_or_name: str | Path,
    *,
    object_mesh: str | Path | None = None,
    terrain_mesh: str | Path | None = None,
    height: float | None = None,
    up: UpAxis | None = None,
    unit: Unit | None = None,
    fps: float | None = None,
    start: float | None = None,
    end: float | None = None,
    skeleton: str | Path | None = None,
    body_model: str | Path | None = None,
) -> Demonstration:
    """Loads a demonstration.

    Args:
        path_or_name: Name of a built-in demonstration, or a file: BVH (``.bvh``), SMPL parameters,
            OMOMO sequences or joint positions (``.npz``), climbing mocap or joint positions
            (``.npy``), InterMimic (``.pt``), DeepMimic (``.txt``, ``.json``).
        object_mesh: Mesh of the object, for formats with an object.
        terrain_mesh: Mesh of the terrain at human scale, z up, for formats without an object.
        height: Standing height of the person, m; None takes what the source says or shows.
        up: Axis of the file that points up: ``"y"``, ``"z"``, …; None finds it.
        unit: Length unit of the file: ``"m"``, ``"cm"``, ``"mm"``, ``"inch"`` or ``"cmu"``; None
            finds it.
        fps: Frames per second of the recording; None takes what the file says.
        start: Beginning of the part to take, s.
        end: End of the part to take, s.
        skeleton: Naming or order of the joints: a known name or a YAML file (``SkeletonMap``).
        body_model: SMPL body model (``.npz``), or a folder of these.

    Raises:
        UnknownNameError: Neither a built-in name nor a file.
        FileFormatError: The file cannot be used; the message says which part and why.
        InvalidOptionError: An option that this source does not take, or a value that is not
            allowed.
    """
    options = SourceOptions(height, up, unit, fps, start, end, skeleton, body_model)
    given = {f.name: getattr(options, f.name) for f in fields(SourceOptions)}
    given |= {"object_mesh": object_mesh, "terrain_mesh": terrain_mesh}
    asked = {name for name, value in given.items() if value is not None}
    if str(path_or_name) in builtin_names():
        _refuse(asked, f"built-in demonstration {path_or_name!r}", ())
        return builtin_demonstration(str(path_or_name))
    path = Path(path_or_name)
    suffix = path.suffix.lower()
    if not suffix and not path.exists():
        raise UnknownNameError("demonstration", str(path_or_name), builtin_names())
    if suffix in _PICKLES:
        expected = "a format without code (opening a pickle runs whatever is in it)"
        hint = f"a pickle; where you trust its maker, convert OMOMO's with: {CONVERSION}"
        raise FileFormatError(path, "file name", expected, hint)
    if suffix not in SUFFIXES:
        expected = f"one that ends in {', '.join(SUFFIXES)}"
        raise FileFormatError(path, "file name", expected, path.name)
    kind = _KINDS[suffix](path, asked) if suffix in _KINDS else suffix
    _refuse(asked, f"{_FORMATS[kind][0]} {path.name}", _FORMATS[kind][1])
    if kind == ".bvh":
        return load_bvh(path, options, terrain_mesh=terrain_mesh)
    if kind == ".pt":
        return load_intermimic(path, options, object_mesh=object_mesh)
    if kind == "mocap":
        return load_mocap(path, options, terrain_mesh=terrain_mesh)
    if kind == "smpl":
        return load_smpl(path, options, terrain_mesh=terrain_mesh)
    if kind == "omomo":
        return load_omomo(path, options, object_mesh=object_mesh)
    if kind == "arrays":
        return load_joint_array(path, options, object_mesh=object_mesh, terrain_mesh=terrain_mesh)
    return load_deepmimic(path, options, terrain_mesh=terrain_mesh)


def _npy_kind(path: Path, asked: Collection[str]) -> str:
    array = map_npy(path, "an array (T, J, 3), T ≥ 1")
    # Who says more about the joints or the axes means another file with as many joints.
    climb = array.ndim == 3 and array.shape[1] == MOCAP.num_joints
    return "mocap" if climb and not {"skeleton", "up", "unit"} & {*asked} else "arrays"


def _npz_kind(path: Path, asked: Collection[str]) -> str:
    names = {*read_npz_members(path, ())[1]}
    if names & {*POSITIONS}:
        return "arrays"
    if names & {*OBJECT_KEYS}:
        return "omomo"
    if names & {"poses", "root_orient", "pose_body"}:
        return "smpl"
    if names & _ROBOT:
        found = "a robot's motion (omni-envs evaluate and view take these)"
        raise FileFormatError(path, "arrays", "a human motion", found)
    expected = "positions (joints), poses and trans (SMPL), or obj_trans (OMOMO)"
    raise FileFormatError(path, "arrays", expected, ", ".join(sorted(names)[:12]) or "none")


_KINDS: dict[str, Callable[[Path, Collection[str]], str]] = {".npy": _npy_kind, ".npz": _npz_kind}


def _refuse(asked: Collection[str], source: str, taken: tuple[str, ...]) -> None:
    for option in sorted(asked):
        if option not in taken:
            takes = f"takes {', '.join(taken)}" if taken else "takes no options"
            raise InvalidOptionError(f"{option} does not apply to {source}, which {takes}.")
