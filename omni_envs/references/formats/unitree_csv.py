"""Unitree's retargeted LAFAN1 tables: one line a frame, root position, quaternion xyzw, hinges."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.references.formats.motion import (
    ForeignMotion,
    MotionFormat,
    checked_poses,
    read_floats,
)
from omni_envs.robots import Robot

if TYPE_CHECKING:
    from omni_envs.references.reference import Reference

ROWS = "rows"
_WXYZ = [0, 1, 2, 6, 3, 4, 5]
_XYZW = [0, 1, 2, 4, 5, 6, 3]


class UnitreeCsv(MotionFormat):
    """(T, 7 + n) comma-separated numbers without a header; 30 frames per second unless told."""

    name = "unitree_csv"
    title = "Unitree table (.csv, 30 Hz unless told), quaternion xyzw"
    suffix = ".csv"
    assumed_fps = 30.0

    def recognises(self, arrays: Mapping[str, np.ndarray], robot: Robot) -> bool:  # noqa: D102
        return ROWS in arrays

    def read(  # noqa: D102
        self, path: Path, arrays: Mapping[str, np.ndarray], robot: Robot, fps: float | None
    ) -> ForeignMotion:
        rows = read_floats(path, ROWS, arrays[ROWS])
        if rows.shape[1] != robot.nq:
            raise FileFormatError(
                path, ROWS, f"{robot.nq} columns for {robot.title}", f"{rows.shape[1]} columns"
            )
        qpos = rows.copy()
        qpos[:, :7] = rows[:, _WXYZ]
        qpos = checked_poses(path, ROWS, qpos)
        return ForeignMotion(path, self.name, robot, fps or self.assumed_fps, qpos)

    def arrays(self, reference: Reference, robot: Robot) -> dict[str, np.ndarray]:  # noqa: D102
        if reference.object_poses is not None:
            raise InvalidOptionError(
                f"format {self.name!r}: has no place for the object "
                f"{reference.scene.object.name if reference.scene.object else ''!r}; formats that "
                "have: holosoma_motion, holosoma_retargeter, omniretarget_dataset."
            )
        rows = reference.qpos.copy()
        rows[:, :7] = reference.qpos[:, _XYZW]
        return {ROWS: rows}


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Reads the table.

    Raises:
        FileFormatError: The file is missing, empty or no table of numbers.
    """
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing .csv file", "nothing")
    if not path.stat().st_size:
        raise FileFormatError(path, ROWS, "at least one line of numbers", "an empty file")
    try:
        rows = np.loadtxt(path, delimiter=",", ndmin=2, encoding="utf-8", comments=None)
    except (ValueError, UnicodeDecodeError, MemoryError) as error:
        lines = str(error).splitlines() or [type(error).__name__]
        expected = "lines of comma-separated numbers, all as long, no header"
        raise FileFormatError(path, ROWS, expected, lines[0][:120]) from error
    return {ROWS: rows}


def write_csv(file: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Writes the table with all digits."""
    np.savetxt(file, arrays[ROWS], fmt="%.17g", delimiter=",")
