"""OmniRetarget's two files of configurations: its released dataset and its retargeter's output."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from omni_envs.errors import FileFormatError
from omni_envs.references.formats.motion import (
    ForeignMotion,
    MotionFormat,
    checked_poses,
    is_unit,
    read_floats,
    read_fps,
)
from omni_envs.robots import Robot

if TYPE_CHECKING:
    from omni_envs.references.reference import Reference

_QUATERNION_FIRST = [3, 4, 5, 6, 0, 1, 2]
_POSITION_FIRST = [4, 5, 6, 0, 1, 2, 3]


class HolosomaRetargeter(MotionFormat):
    """``qpos`` (T, 7 + n [+ 7]) with positions before quaternions, and ``fps``."""

    name = "holosoma_retargeter"
    title = "holosoma retargeter output (.npz)"
    first = False

    def recognises(self, arrays: Mapping[str, np.ndarray], robot: Robot) -> bool:  # noqa: D102
        if not {"qpos", "fps"} <= arrays.keys():
            return False
        qpos = arrays["qpos"]
        numbers = qpos.ndim == 2 and qpos.shape[1] >= 7 and np.issubdtype(qpos.dtype, np.number)
        return (numbers and is_unit(qpos[:, :4]) and not is_unit(qpos[:, 3:7])) == self.first

    def read(  # noqa: D102
        self, path: Path, arrays: Mapping[str, np.ndarray], robot: Robot, fps: float | None
    ) -> ForeignMotion:
        qpos = read_floats(path, "qpos", arrays["qpos"])
        if qpos.shape[1] not in (robot.nq, robot.nq + 7):
            raise FileFormatError(
                path,
                "qpos",
                f"{robot.nq} or {robot.nq + 7} columns for {robot.title}",
                str(qpos.shape),
            )
        if is_unit(qpos[:, :4]) == is_unit(qpos[:, 3:7]):
            raise FileFormatError(
                path,
                "qpos",
                "a unit quaternion in columns 0:4 or else in columns 3:7",
                "none or both",
            )
        poses = qpos[:, robot.nq :] if qpos.shape[1] > robot.nq else None
        qpos = qpos[:, : robot.nq].copy()
        if self.first:
            qpos[:, :7] = qpos[:, _POSITION_FIRST]
            poses = None if poses is None else poses[:, _POSITION_FIRST]
        human = arrays.get("human_joints")
        return ForeignMotion(
            path,
            self.name,
            robot,
            read_fps(path, arrays["fps"]),
            checked_poses(path, "qpos", qpos),
            None if poses is None else checked_poses(path, "qpos", poses),
            None if human is None else read_floats(path, "human_joints", human, dimensions=3),
        )

    def arrays(self, reference: Reference, robot: Robot) -> dict[str, np.ndarray]:  # noqa: D102
        qpos, poses = reference.qpos.copy(), reference.object_poses
        if self.first:
            qpos[:, :7] = qpos[:, _QUATERNION_FIRST]
            poses = None if poses is None else poses[:, _QUATERNION_FIRST]
        arrays = {
            "qpos": qpos if poses is None else np.hstack([qpos, poses]),
            "fps": np.array(reference.fps),
        }
        if reference.source is not None:
            arrays["human_joints"] = reference.source.keypoints.astype(np.float32)
        return arrays


class OmniRetargetDataset(HolosomaRetargeter):
    """The same with quaternions **before** positions, of the root and of the object."""

    name = "omniretarget_dataset"
    title = "OmniRetarget dataset (.npz)"
    first = True
