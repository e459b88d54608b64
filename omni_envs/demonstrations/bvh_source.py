"""Motion capture in BVH files, under any naming of the joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omni_envs.demonstrations.bvh import BvhMotion, read_bvh
from omni_envs.demonstrations.conventions import leg_length, turn_up
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.recording import (
    Conventions,
    Recording,
    find_conventions,
    map_joints,
    to_demonstration,
)
from omni_envs.demonstrations.skeleton_map import SkeletonMap
from omni_envs.demonstrations.source_options import METRES, SourceOptions, kept_fps
from omni_envs.errors import FileFormatError
from omni_envs.robots import KEYPOINTS

_SOURCES = {
    "lafan1": ("Ubisoft La Forge Animation Dataset (LAFAN1)", "CC BY-NC-ND 4.0"),
    "accad": (
        "ACCAD Open Motion Project, The Ohio State University",
        "CC BY 3.0, as third parties record it",
    ),
    "cmu": ("CMU Graphics Lab Motion Capture Database", "free to use, not to be sold as data"),
    "daz": ("CMU Graphics Lab Motion Capture Database", "free to use, not to be sold as data"),
    "bandai-namco": ("Bandai-Namco Research Motion Dataset", "CC BY-NC 4.0"),
}
_TRAVEL = 1e-6  # of a leg; a root that moves less is held in place


def load_bvh(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    terrain_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads a BVH file at 30 fps.

    Joints are recognised by name (``namings.py``) or mapped by ``options.skeleton``; the frame time
    comes from the file; unit and axes are found from the person (``conventions.py``), y up where
    that does not tell.

    Args:
        path: ``.bvh`` file.
        options: What the file does not say, or says wrongly.
        terrain_mesh: Mesh of the terrain at human scale, z up; None is flat ground.

    Raises:
        FileFormatError: The file is missing or damaged, its joints follow no known naming, or the
            person in it is not human in any unit.
    """
    options = SourceOptions() if options is None else options
    recording = record_bvh(path, options)
    joints = map_joints(recording, options)
    conventions = find_conventions(recording, joints, options, usual_up="y")
    _check_root(recording, joints, conventions)
    source, licence = _SOURCES.get(joints.name, ("BVH", "see the source of the file"))
    return to_demonstration(
        recording, joints, conventions, terrain_mesh=terrain_mesh, source=source, licence=licence
    )


def record_bvh(path: str | Path, options: SourceOptions) -> Recording:
    """Reads the part of a BVH file that the options name, before anything is made of it."""
    path = Path(path)
    rate = 0.0

    def rows(frames: int, frame_time: float) -> slice:
        nonlocal rate
        rate = options.frame_rate(path, "Frame Time", 1.0 / frame_time)
        return options.rows(path, frames, rate)

    motion: BvhMotion = read_bvh(path, rows)
    return Recording(
        path,
        tuple(joint.name for joint in motion.joints),
        motion.positions(),
        kept_fps(rate),
        tuple(joint.parent for joint in motion.joints),
        motion.rest_positions(),
    )


def _check_root(recording: Recording, joints: SkeletonMap, conventions: Conventions) -> None:
    """Refuses files whose OFFSETs are in one unit and whose root moves in another.

    Then hips are a hundredth, a thousandth, a hundred or a thousand leg lengths above the origin,
    although they move.
    """
    root = turn_up(recording.positions[:, 0], conventions.up)
    index = [recording.joint_names.index(joints.keypoints[k]) for k in KEYPOINTS]
    leg = leg_length(recording.positions[:, index])
    if np.ptp(root, axis=0).max() < _TRAVEL * leg:
        return
    ratio = float(np.median(root[:, 2])) / leg
    for factor in (0.001, 0.01, 100.0, 1000.0):
        if factor / 1.6 < ratio < factor * 1.6:
            expected = "positions and OFFSETs in one unit"
            metres = METRES[conventions.unit]
            found = f"legs of {leg * metres:.2f} m and hips at {ratio * leg * metres:.4g} m"
            raise FileFormatError(recording.path, "root position", expected, found)
