"""ACCAD motion capture: BVH files of people who walk, crawl and handle (unrecorded) boxes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omni_envs.demonstrations.bvh import BvhMotion, read_bvh
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.floor import level_floor
from omni_envs.demonstrations.resampling import FPS, resample_positions
from omni_envs.demonstrations.skeleton import ACCAD
from omni_envs.errors import FileFormatError

_ANKLE_HEIGHT, _SCALP = 0.08, 0.01  # what a rest skeleton leaves out below and above, m


def load_accad(path: str | Path, *, height: float | None = None) -> Demonstration:
    """Loads a BVH file with the joints of the ACCAD skeleton onto flat, level ground at 30 fps.

    Files in centimetres or metres, y up or z up, at any frame rate are told apart by the rest
    skeleton. (x, y, z) with y up becomes (x, −z, y), which keeps left on the left.

    Args:
        path: ``.bvh`` file.
        height: Standing height of the person, m. None measures the rest skeleton.

    Raises:
        FileFormatError: The file is missing or damaged, or has other joints.
    """
    path = Path(path)
    motion = read_bvh(path)
    names = tuple(joint.name for joint in motion.joints)
    missing = [name for name in ACCAD.joint_names if name not in names]
    if missing:
        raise FileFormatError(
            path, "joints", f"the {ACCAD.name} skeleton", f"no {', '.join(missing)}"
        )
    rest = _rest_pose(motion)
    ankle, head = rest[names.index("LeftFoot")], rest[names.index("HeadEnd")]
    up = int(np.argmax(np.abs(head - ankle)))
    if up == 0 or head[up] < ankle[up]:
        raise FileFormatError(path, "rest pose", "a person upright along +y or +z", "another")
    unit = 0.01 if head[up] - ankle[up] > 10 else 1.0
    positions = unit * motion.positions()
    if up == 1:
        positions = positions[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])
    if height is None:
        height = unit * float(head[up] - ankle[up]) + _ANKLE_HEIGHT + _SCALP
    order = [names.index(name) for name in ACCAD.joint_names]
    positions = resample_positions(positions[:, order], 1.0 / motion.frame_time)
    toes = [ACCAD.joint_names.index(f"{side}ToeBase") for side in ("Left", "Right")]
    return Demonstration(
        name=path.stem,
        fps=FPS,
        joint_names=ACCAD.joint_names,
        positions=level_floor(positions, positions[:, toes], FPS),
        keypoint_joints=ACCAD.keypoint_joints,
        height=height,
        contact_joints=ACCAD.contact_joints,
        source="ACCAD Open Motion Project, The Ohio State University",
        licence="CC BY 3.0, as third parties record it",
    )


def _rest_pose(motion: BvhMotion) -> np.ndarray:
    """(J, 3) joints with every rotation zero, relative to the root, in file units and axes."""
    rest: list[np.ndarray] = []
    for joint in motion.joints:
        rest.append(rest[joint.parent] + joint.offset if joint.parent >= 0 else np.zeros(3))
    return np.array(rest)
