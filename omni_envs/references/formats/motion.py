"""A robot motion in a file of another project: its container, its format, its checks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as shown
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.robots import Robot

if TYPE_CHECKING:
    from omni_envs.references.reference import Reference

MIN_FPS, MAX_FPS = 1.0, 1000.0
RATES = f"{MIN_FPS:g} to {MAX_FPS:g} frames per second"
"""Rates outside are taken for an error."""

_UNIT = 1e-3  # how far the norm of a stored quaternion may be from 1


@dataclass(frozen=True, eq=False)
class ForeignMotion:
    """A robot motion from another project, in our conventions.

    Attributes:
        path: The file.
        format: Name of its format, a key of ``MOTION_FORMATS``.
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


class MotionFormat(ABC):
    """How another project lays a robot motion out in a file of named arrays.

    Attributes:
        name: What users call it.
        title: One line for people.
        suffix: Ending of its files.
        assumed_fps: The rate that files without one are taken to have, or None where they say it.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str] = ".npz"
    assumed_fps: ClassVar[float | None] = None

    @abstractmethod
    def recognises(self, arrays: Mapping[str, np.ndarray], robot: Robot) -> bool:
        """Whether these arrays are of this format."""

    @abstractmethod
    def read(
        self, path: Path, arrays: Mapping[str, np.ndarray], robot: Robot, fps: float | None
    ) -> ForeignMotion:
        """Returns the motion.

        Args:
            path: The file, for messages.
            arrays: Its content.
            robot: The robot it is for.
            fps: The rate, of formats that do not store it.

        Raises:
            FileFormatError: The content is damaged or for another robot.
        """

    @abstractmethod
    def arrays(self, reference: Reference, robot: Robot) -> dict[str, np.ndarray]:
        """Returns the content of a file for a reference.

        Raises:
            InvalidOptionError: The format cannot say what the reference holds.
        """


def whole_fps(reference: Reference, format_name: str) -> np.ndarray:
    """Returns the (1,) rate of a format that counts in whole frames per second."""
    if not float(reference.fps).is_integer():
        raise InvalidOptionError(
            f"format {format_name!r}: needs a whole number of frames per second; the reference has "
            f"{reference.fps}."
        )
    return np.array([int(reference.fps)])


def read_fps(path: Path, array: np.ndarray) -> float:
    """Returns a stored rate, scalar or (1,).

    Raises:
        FileFormatError: It is no number, or no rate that motions are recorded at.
    """
    try:
        fps = float(np.asarray(array).reshape(()))
    except (ValueError, TypeError) as error:
        raise FileFormatError(path, "fps", "one number", shown(array)) from error
    if not is_rate(fps):
        raise FileFormatError(path, "fps", RATES, str(fps))
    return fps


def is_rate(fps: float) -> bool:
    """Whether motions are made or recorded at so many frames per second."""
    return MIN_FPS <= fps <= MAX_FPS


def read_floats(path: Path, name: str, array: np.ndarray, dimensions: int = 2) -> np.ndarray:
    """Returns a non-empty array of finite floats.

    Raises:
        FileFormatError: It is something else.
    """
    if array.ndim != dimensions or not len(array) or not np.issubdtype(array.dtype, np.number):
        raise FileFormatError(
            path, name, f"numbers in {dimensions} dimensions", f"{array.dtype} {array.shape}"
        )
    if not np.isfinite(array).all():
        raise FileFormatError(path, name, "finite numbers", "NaN or infinity")
    return array.astype(float)


def is_unit(quaternions: np.ndarray) -> bool:
    """Whether all (…, 4) quaternions have norm 1."""
    return bool((np.abs(np.linalg.norm(quaternions, axis=-1) - 1) < _UNIT).all())


def checked_poses(path: Path, name: str, poses: np.ndarray) -> np.ndarray:
    """Returns (T, ≥ 7) rows whose columns 3:7 are quaternions wxyz.

    Raises:
        FileFormatError: They are not of unit norm.
    """
    if poses.shape[1] < 7 or not is_unit(poses[:, 3:7]):
        raise FileFormatError(path, name, "unit quaternions wxyz", "another norm")
    return poses
