"""Readers of robot motions that other projects wrote, recognised by what is in the file."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from omni_envs.errors import FileFormatError
from omni_envs.references.kinematics import body_kinematics, generalized_velocities
from omni_envs.references.npz import read_npz
from omni_envs.robots import Robot, get_robot

# A stored body velocity this far (m/s, root mean square) from that of the stored poses is called
# wrong.
_WRONG_VELOCITY = 0.05


@dataclass(frozen=True, eq=False)
class ForeignMotion:
    """A robot motion from another project, in our conventions.

    Attributes:
        path: The file.
        format: What it was recognised as: ``"holosoma_retargeter"``, ``"omniretarget_dataset"`` or
            ``"holosoma_motion"``.
        robot: The robot.
        fps: Frames per second.
        qpos: (T, 7 + n) root position, quaternion wxyz, hinges in model order.
        object_poses: (T, 7) position and quaternion wxyz, or None.
        human_joints: (T, J, 3) scaled human joints, where the file has them.
    """

    path: Path
    format: str
    robot: Robot
    fps: float
    qpos: np.ndarray
    object_poses: np.ndarray | None = None
    human_joints: np.ndarray | None = None


def load_motion(path: str | Path, robot: str | Robot = "g1") -> ForeignMotion:
    """Reads a robot motion of another project.

    Velocities in such files are ignored: ``reference_from_qpos`` makes them from the poses. Where a
    file carries body velocities that contradict its poses, a warning says so.

    Formats, told apart by their arrays:

    - holosoma retargeter: ``qpos`` (T, 7 + n [+ 7]), positions first.
    - OmniRetarget dataset: ``qpos`` (T, 7 + n [+ 7]), quaternions **first**.
    - holosoma motions for reinforcement learning: ``joint_pos`` (T, 7 + n), ``body_pos_w``, …,
      optionally ``object_pos_w``, ``object_quat_w``.

    Args:
        path: The ``.npz`` file.
        robot: The robot that the file is for; none of the formats says it.

    Raises:
        FileFormatError: The file is damaged, of no known format, or for another robot.
    """
    path, robot = Path(path), get_robot(robot)
    arrays = read_npz(path, checked=False)
    if "qpos" in arrays and "fps" in arrays:
        return _read_qpos(path, robot, arrays)
    if {"joint_pos", "body_pos_w", "fps"} <= arrays.keys():
        return _read_motion(path, robot, arrays)
    raise FileFormatError(
        path,
        "arrays",
        "qpos and fps (retargeter, dataset), or joint_pos, body_pos_w and fps (motion)",
        ", ".join(sorted(arrays)) or "none",
    )


def _read_qpos(path: Path, robot: Robot, arrays: Mapping[str, np.ndarray]) -> ForeignMotion:
    qpos = _floats(path, "qpos", arrays["qpos"])
    if qpos.shape[1] not in (robot.nq, robot.nq + 7):
        raise FileFormatError(
            path, "qpos", f"{robot.nq} or {robot.nq + 7} columns for {robot.title}", str(qpos.shape)
        )
    quaternion_first = _unit(qpos[:, :4]) and not _unit(qpos[:, 3:7])
    if not quaternion_first and not (_unit(qpos[:, 3:7]) and not _unit(qpos[:, :4])):
        raise FileFormatError(
            path, "qpos", "a unit quaternion in columns 0:4 or else in columns 3:7", "none or both"
        )
    poses = qpos[:, robot.nq :] if qpos.shape[1] > robot.nq else None
    qpos = qpos[:, : robot.nq].copy()
    if quaternion_first:
        qpos[:, :7] = qpos[:, [4, 5, 6, 0, 1, 2, 3]]
        poses = None if poses is None else poses[:, [4, 5, 6, 0, 1, 2, 3]]
    human = arrays.get("human_joints")
    return ForeignMotion(
        path,
        "omniretarget_dataset" if quaternion_first else "holosoma_retargeter",
        robot,
        _fps(path, arrays["fps"]),
        _normalized(path, "qpos", qpos),
        None if poses is None else _normalized(path, "qpos", poses),
        None if human is None else _floats(path, "human_joints", human, dimensions=3),
    )


def _read_motion(path: Path, robot: Robot, arrays: Mapping[str, np.ndarray]) -> ForeignMotion:
    joints, fps = _floats(path, "joint_pos", arrays["joint_pos"]), _fps(path, arrays["fps"])
    if joints.shape[1] != robot.nq:
        raise FileFormatError(
            path, "joint_pos", f"(T, {robot.nq}): root pose and hinges", str(joints.shape)
        )
    names = [str(n) for n in arrays.get("joint_names", np.array([]))]
    missing = [n for n in robot.joint_names if n not in names]
    if missing:
        raise FileFormatError(path, "joint_names", f"the joints of {robot.title}", f"no {missing}")
    order = [7 + names.index(n) for n in robot.joint_names]
    qpos = _normalized(path, "joint_pos", joints[:, [*range(7), *order]])
    poses = None
    if "object_pos_w" in arrays and "object_quat_w" in arrays:
        parts = []
        for name, width in (("object_pos_w", 3), ("object_quat_w", 4)):
            part = _floats(path, name, arrays[name])
            if part.shape != (len(qpos), width):
                raise FileFormatError(path, name, f"({len(qpos)}, {width})", str(part.shape))
            parts.append(part)
        poses = _normalized(path, "object_quat_w", np.concatenate(parts, axis=1))
    _warn_of_wrong_velocities(path, robot, fps, qpos, arrays)
    return ForeignMotion(path, "holosoma_motion", robot, fps, qpos, poses)


def _warn_of_wrong_velocities(
    path: Path, robot: Robot, fps: float, qpos: np.ndarray, arrays: Mapping[str, np.ndarray]
) -> None:
    stored, names = arrays.get("body_lin_vel_w"), arrays.get("body_names")
    if stored is None or names is None or len(qpos) < 3:
        return
    if stored.shape != (len(qpos), len(names), 3):
        raise FileFormatError(
            path, "body_lin_vel_w", f"({len(qpos)}, {len(names)}, 3)", str(stored.shape)
        )
    order = {str(n): i for i, n in enumerate(names)}
    bodies = [b for b in robot.tracked_bodies if b in order]
    positions, _, _, _ = body_kinematics(robot.model, qpos, generalized_velocities(qpos, fps))
    true = np.gradient(positions, 1.0 / fps, axis=0)
    index = [robot.body_names.index(b) for b in bodies]
    error = stored[1:-1, [order[b] for b in bodies]] - true[1:-1, index]
    worst = np.sqrt(np.mean(np.sum(error**2, axis=-1), axis=0)).max()
    if worst > _WRONG_VELOCITY:
        warnings.warn(
            f"{path}: body velocities contradict the poses by up to {worst:.2f} m/s (root mean "
            "square); they are ignored and made from the poses. Known cause: the root's angular "
            "velocity in the world frame where MuJoCo's free joint has it in the body frame.",
            stacklevel=4,
        )


def _fps(path: Path, array: np.ndarray) -> float:
    try:
        fps = float(np.asarray(array).reshape(-1)[0])
    except (IndexError, ValueError, TypeError) as error:
        raise FileFormatError(path, "fps", "a number", str(array)) from error
    if not (np.isfinite(fps) and fps > 0):
        raise FileFormatError(path, "fps", "a positive number", str(fps))
    return fps


def _floats(path: Path, name: str, array: np.ndarray, dimensions: int = 2) -> np.ndarray:
    if array.ndim != dimensions or not len(array) or not np.issubdtype(array.dtype, np.number):
        raise FileFormatError(
            path, name, f"numbers in {dimensions} dimensions", f"{array.dtype} {array.shape}"
        )
    if not np.isfinite(array).all():
        raise FileFormatError(path, name, "finite numbers", "NaN or infinity")
    return array.astype(float)


def _unit(quaternions: np.ndarray) -> bool:
    return bool((np.abs(np.linalg.norm(quaternions, axis=1) - 1) < 1e-3).all())


def _normalized(path: Path, name: str, poses: np.ndarray) -> np.ndarray:
    if poses.shape[1] < 7 or not _unit(poses[:, 3:7]):
        raise FileFormatError(path, name, "unit quaternions wxyz", "another norm")
    poses = poses.copy()
    poses[:, 3:7] /= np.linalg.norm(poses[:, 3:7], axis=1, keepdims=True)
    return poses
