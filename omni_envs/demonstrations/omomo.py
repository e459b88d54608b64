"""OMOMO sequences: SMPL parameters of a person with the pose of an object.

OMOMO ships ``train_diffusion_manip_seq_joints24.p``, a joblib pickle of all sequences. Opening a
pickle runs whatever code is in it, so it is refused; one line converts it where its maker is
trusted, into one ``.npz`` per sequence with the same fields.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from omni_envs.demonstrations.arrays import read_npz_members
from omni_envs.demonstrations.body_model import pose_joints
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.intermimic import LARGEBOX, SUBJECT_HEIGHTS
from omni_envs.demonstrations.namings import SMPL_BODY
from omni_envs.demonstrations.recording import (
    Recording,
    find_conventions,
    map_joints,
    to_demonstration,
)
from omni_envs.demonstrations.resampling import FPS
from omni_envs.demonstrations.smpl import KEYS, SmplParameters, pose_body, read_parameters
from omni_envs.demonstrations.source_options import SourceOptions, kept_fps
from omni_envs.errors import FileFormatError
from omni_envs.resampling import resample_poses
from omni_envs.scenes import Part, Scene, SceneObject, load_convex_parts

OBJECT_KEYS = ("obj_trans", "obj_rot", "obj_scale")
_BONES = ("rest_offsets", "trans2joint")
_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)

CONVERSION = (
    'python -c "import joblib, numpy as np; '
    "[np.savez(s['seq_name'] + '.npz', **s) for s in joblib.load('FILE.p').values()]\""
)
"""Turns OMOMO's pickle into files that ``load_omomo`` reads; for those who trust its maker."""


def load_omomo(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    object_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads one OMOMO sequence, 30 fps, z up, m.

    Joints come from the sequence's own ``rest_offsets`` and ``trans2joint``, or from the body model
    if ``options.body_model`` is given. The object is scaled by ``obj_scale``.

    Args:
        path: ``.npz`` file with the fields of one sequence (see ``CONVERSION``).
        options: What the file does not say. The height is looked up by the subject in the file's
            name (``sub3_largebox_003.npz``), else estimated.
        object_mesh: Mesh of the object. None looks for ``<object>.obj`` beside the file, then for
            an object known by name (``largebox``).

    Raises:
        FileFormatError: The file is missing, damaged or incomplete, or there is no object.
    """
    options = SourceOptions() if options is None else options
    path = Path(path)
    arrays, names = read_npz_members(path, (*KEYS, *OBJECT_KEYS, *_BONES))
    parameters = read_parameters(path, arrays, names, options, usual_fps=FPS)
    height = None
    if options.body_model is not None:
        recording, height = pose_body(path, parameters, options.body_model)
    else:
        recording = _pose_bones(path, parameters, arrays)
    match = re.fullmatch(r"(sub\d+)_(.+?)(?:_\d+)?", path.stem)
    subject, name = match.groups() if match else ("", "object")
    poses, size = _object_poses(path, parameters, arrays)
    parts: tuple[Part, ...]
    if object_mesh is None and (beside := path.with_name(f"{name}.obj")).is_file():
        object_mesh = beside
    if object_mesh is not None:
        parts = load_convex_parts(object_mesh)
    elif name == "largebox":
        parts, size = (LARGEBOX,), 1.0  # at its true size already
    else:
        expected = f"object_mesh=, or a mesh {name}.obj beside the file"
        raise FileFormatError(path, "object", expected, "neither")
    joints = map_joints(recording, options)
    conventions = find_conventions(
        recording, joints, options, up="z", unit="m", height=SUBJECT_HEIGHTS.get(subject, height)
    )
    return to_demonstration(
        recording,
        joints,
        conventions,
        scene=Scene(object=SceneObject(name, parts).scaled(size)),
        object_poses=poses,
        source="OMOMO",
        licence="OMOMO terms: non-commercial research",
    )


def _pose_bones(path: Path, parameters: SmplParameters, arrays: dict[str, np.ndarray]) -> Recording:
    offsets, shift = arrays.get("rest_offsets"), arrays.get("trans2joint")
    if offsets is None or shift is None:
        found = "no rest_offsets and trans2joint"
        raise FileFormatError(path, "arrays", "bones, or the option body_model", found)
    count = len(SMPL_BODY)
    shape = offsets.shape if offsets.ndim == 2 else (0, 0)
    for field, array, fits in (
        ("rest_offsets", offsets, shape[0] >= count and shape[1] == 3),
        ("trans2joint", shift, shift.size == 3),
    ):
        if not fits or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            found = f"{array.dtype} {array.shape}"
            raise FileFormatError(path, field, "finite offsets of joints, m", found)
    rest = np.zeros((count, 3))
    for joint in range(1, count):
        rest[joint] = rest[_PARENTS[joint]] + offsets[joint]
    # trans is where the body model's origin goes; its root joint is at −trans2joint from there.
    root = parameters.translation - shift.reshape(3)
    positions = pose_joints(rest, _PARENTS, parameters.turns, root)
    return Recording(path, SMPL_BODY, positions, kept_fps(parameters.fps), _PARENTS)


def _object_poses(
    path: Path, parameters: SmplParameters, arrays: dict[str, np.ndarray]
) -> tuple[np.ndarray, float]:
    """(T, 7) poses at 30 fps, and the factor on the object's mesh."""
    missing = [key for key in OBJECT_KEYS if key not in arrays]
    if missing:
        raise FileFormatError(path, "arrays", ", ".join(OBJECT_KEYS), f"no {', '.join(missing)}")
    place, turn, scale = (arrays[key] for key in OBJECT_KEYS)
    frames = parameters.rows.stop
    for key, array, size in (
        ("obj_trans", place, 3), ("obj_rot", turn, 9), ("obj_scale", scale, 1)
    ):  # fmt: skip
        fits = array.ndim >= 1 and len(array) >= frames and array.size == len(array) * size
        if not fits or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            found = f"{array.dtype} {array.shape}"
            raise FileFormatError(path, key, f"finite numbers, {size} per frame", found)
    rows = parameters.rows
    matrices = turn[rows].reshape(-1, 3, 3).astype(float)
    error = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max()
    if error > 1e-3 or (np.linalg.det(matrices) < 0).any():
        raise FileFormatError(path, "obj_rot", "rotation matrices", f"off by {error:.2g}")
    factor = float(np.median(scale))
    if not 1e-3 < factor < 1e3:
        raise FileFormatError(path, "obj_scale", "a positive factor", f"{factor:g}")
    quaternions = Rotation.from_matrix(matrices).as_quat(scalar_first=True)
    poses = np.concatenate([place[rows].reshape(-1, 3).astype(float), quaternions], axis=1)
    fps = kept_fps(parameters.fps)
    return (poses if fps == FPS else resample_poses(poses, fps, FPS)), factor
