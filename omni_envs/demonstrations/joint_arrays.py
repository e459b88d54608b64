"""Joint positions as arrays: ``.npy`` without names, ``.npz`` with names and frame rate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from omni_envs.demonstrations.arrays import map_npy, read_npz_members
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.namings import nameless_orders, skeleton_map
from omni_envs.demonstrations.recording import (
    Recording,
    find_conventions,
    map_joints,
    to_demonstration,
)
from omni_envs.demonstrations.resampling import FPS
from omni_envs.demonstrations.skeleton_map import SkeletonMap
from omni_envs.demonstrations.source_options import SourceOptions, kept_fps
from omni_envs.errors import FileFormatError
from omni_envs.resampling import resample_poses
from omni_envs.scenes import Scene, SceneObject, load_convex_parts

POSITIONS = ("positions", "global_joint_positions", "joint_positions", "joints")
"""Names under which an archive may hold the (T, J, 3) positions."""

_KEYS = (*POSITIONS, "fps", "joint_names", "height", "object_poses")
_RIGID = 0.05  # relative spread of a bone's length, above which two points are not its ends


def load_joint_array(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    object_mesh: str | Path | None = None,
    terrain_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads joint positions at 30 fps.

    ``.npz``: ``positions`` (or ``global_joint_positions``, ``joint_positions``, ``joints``)
    (T, J, 3), ``fps``, ``joint_names`` (J,), and if wanted ``height`` (m) and ``object_poses``
    (T, 7), position and quaternion wxyz in the axes z up, m, with ``object_mesh``. ``.npy``: the
    positions alone, so the frame rate has to be given. Without names the order of the joints is
    that of ``options.skeleton``, or of the one known skeleton with that many joints whose bones
    keep a human length.

    Args:
        path: ``.npy`` or ``.npz`` file.
        options: What the file does not say, or says wrongly.
        object_mesh: Mesh of the object that ``object_poses`` moves.
        terrain_mesh: Mesh of the terrain at human scale, z up.

    Raises:
        FileFormatError: The file is missing, damaged, carries pickled objects in a field that
            counts, or lacks something that no option tells.
    """
    options = SourceOptions() if options is None else options
    recording, rows, arrays = _read(Path(path), options)
    recording = name_joints(recording, options)
    joints = map_joints(recording, options)
    scene, poses = None, arrays.get("object_poses")
    if poses is not None:
        scene, poses = _object(recording, rows, poses, object_mesh)
    elif object_mesh is not None:
        raise FileFormatError(path, "object_poses", "poses for the object mesh", "no such array")
    height = arrays.get("height")
    conventions = find_conventions(
        recording,
        joints,
        options,
        # The object is in metres, z up, and the person with it.
        up=None if poses is None else "z",
        unit=None if poses is None else "m",
        height=None if height is None else _number(recording.path, "height", height),
    )
    return to_demonstration(
        recording,
        joints,
        conventions,
        terrain_mesh=terrain_mesh,
        scene=scene,
        object_poses=poses,
        source="joint positions",
    )


def record_joint_array(path: str | Path, options: SourceOptions) -> Recording:
    """Reads the part of an array file that the options name, before anything is made of it."""
    return _read(Path(path), options)[0]


def _read(path: Path, options: SourceOptions) -> tuple[Recording, slice, dict[str, np.ndarray]]:
    """The recording (without joint names where the file has none), its rows, and other arrays."""
    arrays: dict[str, np.ndarray] = {}
    field = "content"
    if path.suffix.lower() == ".npy":
        positions = map_npy(path, "an array (T, J, 3), T ≥ 1")
    else:
        arrays, names = read_npz_members(path, _KEYS)
        field = next((key for key in POSITIONS if key in arrays), "")
        if not field:
            found = ", ".join(names) or "none"
            expected = f"joint positions as one of {', '.join(POSITIONS)} (numbers, no objects)"
            raise FileFormatError(path, "arrays", expected, found)
        positions = arrays[field]
    if positions.ndim != 3 or positions.shape[2] != 3 or 0 in positions.shape:
        raise FileFormatError(path, field, "shape (T, J, 3), T ≥ 1", f"shape {positions.shape}")
    if positions.dtype.kind not in "fiu":
        raise FileFormatError(path, field, "numbers", f"values of type {positions.dtype}")
    stated = _number(path, "fps", arrays["fps"]) if "fps" in arrays else None
    fps = options.frame_rate(path, "fps", stated)
    rows = options.rows(path, len(positions), fps)
    kept = np.asarray(positions[rows], float)
    bad = ~np.isfinite(kept).all(axis=(1, 2))
    if bad.any():
        frame = rows.start + rows.step * int(np.argmax(bad))
        expected = "finite joint positions"
        raise FileFormatError(path, field, expected, f"NaN or infinity first in frame {frame}")
    names = _names(path, arrays, kept.shape[1])
    return Recording(path, names, kept, kept_fps(fps)), rows, arrays


def name_joints(recording: Recording, options: SourceOptions) -> Recording:
    """Names the joints of an array without names, by the skeleton given or the one that fits.

    Raises:
        FileFormatError: No known order fits, or the one given has another number of joints.
    """
    if recording.joint_names:
        return recording
    joints = _nameless(recording, options)
    assert joints.joint_names is not None
    return replace(recording, joint_names=joints.joint_names)


def _names(path: Path, arrays: dict[str, np.ndarray], joints: int) -> tuple[str, ...]:
    if "joint_names" not in arrays:
        return ()
    stored = arrays["joint_names"]
    if stored.dtype.kind not in "US" or stored.shape != (joints,):
        found = f"{stored.dtype} {stored.shape}"
        raise FileFormatError(path, "joint_names", f"{joints} names, one per joint", found)
    names = tuple(
        n.decode("utf-8", "replace") if isinstance(n, bytes) else str(n) for n in stored.tolist()
    )
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise FileFormatError(path, "joint_names", "names that differ", f"several {twice}")
    return names


def _nameless(recording: Recording, options: SourceOptions) -> SkeletonMap:
    path, count = recording.path, recording.positions.shape[1]
    if options.skeleton is not None:
        joints = skeleton_map(options.skeleton, (), path, count)
        if joints.joint_names is None or len(joints.joint_names) != count:
            found = "none" if joints.joint_names is None else f"{len(joints.joint_names)}"
            raise FileFormatError(path, "skeleton", f"joint_names for {count} joints", found)
        return joints
    orders = [order for order in nameless_orders(count) if _is_human(recording, order)]
    if len(orders) == 1:
        return orders[0]
    expected = f"joint names, or the option skeleton: the order of these {count} joints"
    found = " or ".join(order.name for order in orders) or "no known skeleton that fits"
    raise FileFormatError(path, "joints", expected, found)


def _is_human(recording: Recording, joints: SkeletonMap) -> bool:
    """Whether limbs keep their lengths and the two sides are alike under this order."""
    assert joints.joint_names is not None
    index = [joints.joint_names.index(joint) for joint in joints.keypoints.values()]
    points = recording.positions[:, index]
    at = dict(zip(joints.keypoints, np.moveaxis(points, 1, 0), strict=True))
    lengths: dict[str, float] = {}
    for side in ("left", "right"):
        for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "hand")):
            bone = np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=1)
            if not bone.mean() > 0 or bone.std() > _RIGID * bone.mean():
                return False
            lengths[f"{side} {a}"] = float(bone.mean())
    ratios = [lengths[f"left {part}"] / lengths[f"right {part}"] for part in ("hip", "knee")]
    alike = all(abs(ratio - 1) < 0.2 for ratio in ratios)
    limbs = 0.7 < lengths["left hip"] / lengths["left knee"] < 1.5
    arm = lengths["left shoulder"] + lengths["left elbow"]
    return alike and limbs and 0.4 < arm / (lengths["left hip"] + lengths["left knee"]) < 1.0


def _object(
    recording: Recording, rows: slice, poses: np.ndarray, mesh: str | Path | None
) -> tuple[Scene, np.ndarray]:
    path = recording.path
    if mesh is None:
        raise FileFormatError(path, "object_poses", "the option object_mesh with it", "none")
    if poses.dtype.kind not in "fiu" or poses.shape[1:] != (7,) or len(poses) < rows.stop:
        found = f"{poses.dtype} {poses.shape}"
        raise FileFormatError(path, "object_poses", "(T, 7), as long as the positions", found)
    kept = np.array(poses[rows], float)
    norm = np.linalg.norm(kept[:, 3:], axis=1)
    if not np.isfinite(kept).all() or (np.abs(norm - 1) > 1e-3).any():
        expected = "finite positions and unit quaternions wxyz"
        raise FileFormatError(path, "object_poses", expected, "others")
    kept[:, 3:] /= norm[:, None]
    if recording.fps != FPS:
        kept = resample_poses(kept, recording.fps, FPS)
    return Scene(object=SceneObject(Path(mesh).stem, load_convex_parts(mesh))), kept


def _number(path: Path, field: str, array: np.ndarray) -> float:
    if array.size != 1 or array.dtype.kind not in "fiu":
        raise FileFormatError(path, field, "one number", f"{array.dtype} {array.shape}")
    value = float(array.reshape(-1)[0])
    if not (np.isfinite(value) and value > 0):
        raise FileFormatError(path, field, "a positive number", f"{value:g}")
    return value
