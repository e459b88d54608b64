"""SMPL, SMPL-H and SMPL-X parameters: AMASS ``.npz`` files and their like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from omni_envs.demonstrations.arrays import read_npz_members
from omni_envs.demonstrations.body_model import WHERE, BodyModel, load_body_model, pose_joints
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.namings import SMPL_ORDERS
from omni_envs.demonstrations.recording import (
    Recording,
    find_conventions,
    map_joints,
    to_demonstration,
)
from omni_envs.demonstrations.source_options import SourceOptions, kept_fps
from omni_envs.errors import FileFormatError

KEYS = (
    "trans", "poses", "root_orient", "pose_body", "pose_hand", "betas", "gender",
    "mocap_framerate", "mocap_frame_rate", "fps", "surface_model_type",
)  # fmt: skip
"""Arrays of a parameter file that are read; others, pickled ones among them, are left alone."""

_RATES = ("mocap_frame_rate", "mocap_framerate", "fps")
_KINDS = {72: "smpl", 156: "smplh", 165: "smplx"}
_JOINTS = {"smpl": 24, "smplh": 52, "smplx": 55}


@dataclass(frozen=True, eq=False)
class SmplParameters:
    """The part of a parameter file that is taken.

    Attributes:
        turns: (T, J, 3) rotation vectors of the first J joints, rad.
        translation: (T, 3) m.
        betas: (B,) shape.
        gender: Gender of the body, where the file says it.
        kind: ``"smpl"``, ``"smplh"`` or ``"smplx"``, where the size of ``poses`` or the file tells.
        fps: Frames per second of the file.
        rows: Frames of the file that these are.
    """

    turns: np.ndarray
    translation: np.ndarray
    betas: np.ndarray
    gender: str | None
    kind: str | None
    fps: float
    rows: slice


def load_smpl(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    terrain_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads SMPL parameters at 30 fps.

    Read are ``trans`` (T, 3), ``poses`` (T, 72, 156 or 165) or ``root_orient`` (T, 3) with
    ``pose_body`` (T, 63), ``betas``, ``gender`` and ``mocap_framerate``. Joints come from the body
    model that ``options.body_model`` names: the user's own, for its licence lets nobody ship it.
    The person is as tall as the model's body of that shape.

    Args:
        path: ``.npz`` file.
        options: What the file does not say, or says wrongly.
        terrain_mesh: Mesh of the terrain at human scale, z up.

    Raises:
        FileFormatError: File or body model are missing, damaged or incomplete.
    """
    options = SourceOptions() if options is None else options
    path = Path(path)
    arrays, names = read_npz_members(path, KEYS)
    parameters = read_parameters(path, arrays, names, options)
    if options.body_model is None:
        expected = f"the option body_model: {WHERE}"
        raise FileFormatError(path, "body model", expected, "none")
    recording, height = pose_body(path, parameters, options.body_model)
    joints = map_joints(recording, options)
    conventions = find_conventions(
        recording, joints, options, unit="m", height=height, usual_up="z"
    )
    return to_demonstration(
        recording,
        joints,
        conventions,
        terrain_mesh=terrain_mesh,
        source="SMPL parameters",
        licence="see the source of the file; AMASS: non-commercial research",
    )


def read_parameters(
    path: Path,
    arrays: Mapping[str, np.ndarray],
    names: tuple[str, ...],
    options: SourceOptions,
    usual_fps: float | None = None,
) -> SmplParameters:
    """Checks the arrays of a parameter file.

    Args:
        path: The file, for error messages.
        arrays: Its arrays among ``KEYS``.
        names: Names of all its arrays.
        options: What the user says.
        usual_fps: Frame rate of a format that never states it.

    Raises:
        FileFormatError: Something is missing, or not what it should be.
    """
    posed = "poses" in arrays or {"root_orient", "pose_body"} <= arrays.keys()
    if "trans" not in arrays or not posed:
        expected = "trans, and poses or root_orient and pose_body"
        raise FileFormatError(path, "arrays", expected, ", ".join(names) or "none")
    if "poses" in arrays:
        poses = _matrix(path, "poses", arrays["poses"], None)
        if poses.shape[1] not in _KINDS:
            expected = "72 (SMPL), 156 (SMPL-H) or 165 (SMPL-X) columns"
            raise FileFormatError(path, "poses", expected, str(poses.shape[1]))
        kind: str | None = _KINDS[poses.shape[1]]
    else:
        root = _matrix(path, "root_orient", arrays["root_orient"], 3)
        poses = np.hstack([root, _matrix(path, "pose_body", arrays["pose_body"], 63, len(root))])
        stated = arrays.get("surface_model_type", np.zeros(0))
        kind = next((k for k in _JOINTS if k == _text(stated)), None)
    trans = _matrix(path, "trans", arrays["trans"], 3, len(poses))
    betas = arrays.get("betas", np.zeros(10))
    if betas.dtype.kind not in "fiu" or not betas.size or not np.isfinite(betas).all():
        found = f"{betas.dtype} {betas.shape}"
        raise FileFormatError(path, "betas", "finite shape parameters", found)
    rate = next((key for key in _RATES if key in arrays), None)
    stated_fps = usual_fps
    if rate is not None:
        if arrays[rate].size != 1 or arrays[rate].dtype.kind not in "fiu":
            found = f"{arrays[rate].dtype} {arrays[rate].shape}"
            raise FileFormatError(path, rate, "one number", found)
        stated_fps = float(arrays[rate].reshape(-1)[0])
    fps = options.frame_rate(path, rate or _RATES[1], stated_fps)
    rows = options.rows(path, len(poses), fps)
    kept = {"poses": poses[rows], "trans": trans[rows]}
    for field, values in kept.items():
        bad = ~np.isfinite(values).all(axis=1)
        if bad.any():
            frame = rows.start + rows.step * int(np.argmax(bad))
            found = f"NaN or infinity first in frame {frame}"
            raise FileFormatError(path, field, "finite values", found)
    gender = arrays.get("gender")
    return SmplParameters(
        kept["poses"].reshape(len(kept["poses"]), -1, 3).astype(float),
        kept["trans"].astype(float),
        betas.reshape(-1, betas.shape[-1] if betas.ndim else 1)[0].astype(float),
        None if gender is None else _text(gender),
        kind,
        fps,
        rows,
    )


def pose_body(
    path: Path, parameters: SmplParameters, body_model: str | Path
) -> tuple[Recording, float]:
    """The joints of the user's body model under the parameters, and its standing height, m.

    Raises:
        FileFormatError: The model cannot be used, or is of another kind than the parameters.
    """
    model: BodyModel = load_body_model(body_model, parameters.kind, parameters.gender)
    if model.num_joints not in SMPL_ORDERS:
        expected = ", ".join(f"{n} ({k})" for k, n in _JOINTS.items())
        raise FileFormatError(model.path, "joints", expected, str(model.num_joints))
    if parameters.kind is not None and _JOINTS[parameters.kind] != model.num_joints:
        expected = f"a {parameters.kind} model of {_JOINTS[parameters.kind]} joints, as {path.name}"
        found = f"{model.num_joints} joints (shape parameters of one do not fit the other)"
        raise FileFormatError(model.path, "body model", expected, found)
    rest, height = model.rest(parameters.betas)
    positions = pose_joints(rest, model.parents, parameters.turns, parameters.translation)
    names = SMPL_ORDERS[model.num_joints]
    # The rest pose stands y up whatever the motion does, so it says nothing about the axes.
    return Recording(path, names, positions, kept_fps(parameters.fps), model.parents), height


def _matrix(
    path: Path, field: str, array: np.ndarray, columns: int | None, rows: int | None = None
) -> np.ndarray:
    fits = array.ndim == 2 and len(array) > 0 and array.dtype.kind in "fiu"
    if not fits or columns not in (None, array.shape[1]) or rows not in (None, len(array)):
        expected = f"numbers ({rows or 'T'}, {columns or '72, 156 or 165'})"
        raise FileFormatError(path, field, expected, f"{array.dtype} {array.shape}")
    return array


def _text(array: np.ndarray) -> str | None:
    if array.dtype.kind not in "US" or array.size != 1:
        return None
    value = array.reshape(-1)[0]
    return (value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)).lower()
