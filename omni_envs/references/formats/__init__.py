"""Robot motions of other projects: read, recognised by what is in the file, and written."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.files import complete_file
from omni_envs.references.formats.holosoma import HolosomaMotion
from omni_envs.references.formats.motion import RATES, ForeignMotion, MotionFormat, is_rate
from omni_envs.references.formats.qpos import HolosomaRetargeter, OmniRetargetDataset
from omni_envs.references.formats.tracking import BeyondMimic, Mjlab, UnitreeDeploy
from omni_envs.references.formats.unitree_csv import UnitreeCsv, read_csv, write_csv
from omni_envs.references.npz import read_npz
from omni_envs.references.reference import Reference
from omni_envs.robots import Robot, get_robot

__all__ = ["MOTION_FORMATS", "ForeignMotion", "MotionFormat", "load_motion", "save_motion"]

MOTION_FORMATS: dict[str, MotionFormat] = {
    f.name: f
    for f in (
        OmniRetargetDataset(),
        HolosomaRetargeter(),
        HolosomaMotion(),
        BeyondMimic(),
        Mjlab(),
        UnitreeDeploy(),
        UnitreeCsv(),
    )
}
"""Name to format, in the order in which files are tried."""


def load_motion(
    path: str | Path, robot: str | Robot = "g1", *, fps: float | None = None
) -> ForeignMotion:
    """Reads a robot motion of another project.

    The format is told by the file's ending and arrays, see ``MOTION_FORMATS``. Velocities in such
    files are ignored: ``reference_from_qpos`` makes them from the poses. Where a file carries body
    velocities that contradict its poses, a warning says so.

    Args:
        path: The ``.npz`` or ``.csv`` file.
        robot: The robot that the file is for; none of the formats says it.
        fps: Frames per second, of formats that do not store it (``unitree_csv``: 30 if not given,
            ``unitree_deploy``: 50).

    Raises:
        FileFormatError: The file is damaged, of no known format, or for another robot.
        InvalidOptionError: ``fps`` is given for a file that tells it, or is no rate.
    """
    path, robot = Path(path), get_robot(robot)
    if fps is not None and not is_rate(fps):
        raise InvalidOptionError(f"fps: expected {RATES}; got {fps}.")
    arrays = read_csv(path) if path.suffix == ".csv" else read_npz(path, checked=False)
    for kind in MOTION_FORMATS.values():
        if kind.recognises(arrays, robot):
            if fps is not None and kind.assumed_fps is None:
                raise InvalidOptionError(f"fps: {path} tells its own, as {kind.name!r} files do.")
            return kind.read(path, arrays, robot, fps)
    raise FileFormatError(
        path,
        "arrays",
        "qpos and fps (retargeter, dataset), or joint_pos and body_pos_w (motion)",
        ", ".join(sorted(arrays)) or "none",
    )


def save_motion(reference: Reference, path: str | Path, kind: str) -> Path:
    """Writes a reference for another project; ``load_motion`` reads it back exactly.

    Args:
        reference: The reference.
        path: The file; its folder is made where needed. Complete or absent, whatever happens.
        kind: A name of ``MOTION_FORMATS``. ``unitree_deploy`` holds single precision.

    Returns:
        The path.

    Raises:
        InvalidOptionError: No such format, another file ending, or the format cannot hold the
            reference.
    """
    if kind not in MOTION_FORMATS:
        raise InvalidOptionError(
            f"format: expected one of {', '.join(MOTION_FORMATS)}; got {kind!r}."
        )
    path, found = Path(path), MOTION_FORMATS[kind]
    if path.suffix != found.suffix:
        raise InvalidOptionError(f"{path}: {kind!r} files end in {found.suffix}.")
    arrays = found.arrays(reference, get_robot(reference.robot))
    with complete_file(path) as temporary:
        if found.suffix == ".csv":
            write_csv(temporary, arrays)
        else:
            with temporary.open("wb") as file:
                # Uncompressed: small readers of deploy code know no deflate.
                np.savez(file, allow_pickle=False, **arrays)
    return path
