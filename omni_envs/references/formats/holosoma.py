"""holosoma's motions for reinforcement learning: all bodies, names inside, object included."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from omni_envs.errors import FileFormatError
from omni_envs.references.formats.motion import (
    ForeignMotion,
    MotionFormat,
    checked_poses,
    read_floats,
    read_fps,
    whole_fps,
)
from omni_envs.references.kinematics import body_kinematics, generalized_velocities
from omni_envs.robots import Robot

if TYPE_CHECKING:
    from omni_envs.references.reference import Reference

# A stored body velocity this far (m/s, root mean square) from that of the stored poses is called
# wrong.
_WRONG_VELOCITY = 0.05
_OBJECT = "object"


class HolosomaMotion(MotionFormat):
    """``joint_pos`` (T, 7 + n), ``joint_vel`` (T, 6 + n), ``body_*_w`` with the world first."""

    name = "holosoma_motion"
    title = "holosoma motion for reinforcement learning (.npz)"

    def recognises(self, arrays: Mapping[str, np.ndarray], robot: Robot) -> bool:  # noqa: D102
        if not {"joint_pos", "body_pos_w", "fps", "joint_names"} <= arrays.keys():
            return False
        # Files of hinges alone name as many joints as they have columns.
        columns, names = arrays["joint_pos"].shape[-1:], arrays["joint_names"].shape
        return columns != names or "body_quat_w" not in arrays

    def read(  # noqa: D102
        self, path: Path, arrays: Mapping[str, np.ndarray], robot: Robot, fps: float | None
    ) -> ForeignMotion:
        joints, fps = (
            read_floats(path, "joint_pos", arrays["joint_pos"]),
            read_fps(path, arrays["fps"]),
        )
        if joints.shape[1] != robot.nq:
            raise FileFormatError(
                path, "joint_pos", f"(T, {robot.nq}): root pose and hinges", str(joints.shape)
            )
        order = [7 + i for i in joint_order(path, arrays, robot)]
        qpos = checked_poses(path, "joint_pos", joints[:, [*range(7), *order]])
        poses = None
        if "object_pos_w" in arrays and "object_quat_w" in arrays:
            parts = []
            for name, width in (("object_pos_w", 3), ("object_quat_w", 4)):
                part = read_floats(path, name, arrays[name])
                if part.shape != (len(qpos), width):
                    raise FileFormatError(path, name, f"({len(qpos)}, {width})", str(part.shape))
                parts.append(part)
            poses = checked_poses(path, "object_quat_w", np.concatenate(parts, axis=1))
        _warn_of_wrong_velocities(path, robot, fps, qpos, arrays)
        return ForeignMotion(path, self.name, robot, fps, qpos, poses)

    def arrays(self, reference: Reference, robot: Robot) -> dict[str, np.ndarray]:  # noqa: D102
        frames = reference.num_frames
        bodies = {
            "pos": reference.body_positions,
            "quat": reference.body_quaternions,
            "lin_vel": reference.body_linear_velocities,
            "ang_vel": reference.body_angular_velocities,
        }
        names = ["world", *reference.body_names]
        for key, array in bodies.items():
            still = np.zeros((frames, 1, array.shape[2]))
            if key == "quat":
                still[..., 0] = 1.0
            bodies[key] = np.concatenate([still, array], axis=1)
        arrays: dict[str, np.ndarray] = {}
        if reference.object_poses is not None and reference.object_velocities is not None:
            poses, velocities = reference.object_poses, reference.object_velocities
            motion = {
                "pos": poses[:, :3],
                "quat": poses[:, 3:],
                "lin_vel": velocities[:, :3],
                "ang_vel": velocities[:, 3:],
            }
            arrays = {f"{_OBJECT}_{key}_w": array for key, array in motion.items()}
            names.append(_OBJECT)
            for key, array in motion.items():
                bodies[key] = np.concatenate([bodies[key], array[:, None]], axis=1)
        return {
            "fps": whole_fps(reference, self.name),
            "joint_pos": reference.qpos,
            "joint_vel": reference.qvel,
            **{f"body_{key}_w": array for key, array in bodies.items()},
            **arrays,
            "joint_names": np.array(robot.joint_names),
            "body_names": np.array(names),
        }


def joint_order(path: Path, arrays: Mapping[str, np.ndarray], robot: Robot) -> list[int]:
    """Returns where each of the robot's hinges stands among the file's ``joint_names``.

    Raises:
        FileFormatError: One is missing or named twice.
    """
    names = [str(n) for n in arrays["joint_names"].reshape(-1)]
    missing = [n for n in robot.joint_names if names.count(n) != 1]
    if missing:
        raise FileFormatError(
            path, "joint_names", f"each joint of {robot.title} once", f"not once {missing}"
        )
    return [names.index(n) for n in robot.joint_names]


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
