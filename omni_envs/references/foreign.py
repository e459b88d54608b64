"""References out of motions that other projects made, so that all are judged alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from omni_envs.demonstrations import Demonstration, SourceMotion, scale_demonstration
from omni_envs.demonstrations.source_resampling import resample_source
from omni_envs.errors import InvalidDataError
from omni_envs.metrics import evaluate
from omni_envs.references.build import STANCE
from omni_envs.references.formats import ForeignMotion, load_motion
from omni_envs.references.kinematics import reference_from_qpos
from omni_envs.references.npz import read_npz
from omni_envs.references.reference import Reference
from omni_envs.robots import Robot
from omni_envs.scenes import Scene


def open_reference(
    path: str | Path, robot: str | Robot = "g1", demonstration: Demonstration | None = None
) -> Reference:
    """Opens a reference of ours, or completes a robot motion of another project to one.

    Args:
        path: A file that ``Reference.save`` wrote, or any that ``load_motion`` reads.
        robot: The robot of a foreign motion.
        demonstration: What a foreign motion was made from.

    Raises:
        FileFormatError: The file is neither, or damaged.
        InvalidDataError: The foreign motion does not fit robot or demonstration.
    """
    if "format" in read_npz(path, checked=False):
        return Reference.load(path)
    return reference_from_motion(load_motion(path, robot), demonstration)


def reference_from_motion(
    motion: ForeignMotion, demonstration: Demonstration | None = None
) -> Reference:
    """Completes a foreign motion to a reference: velocities from its poses, scene, source, report.

    Args:
        motion: What ``load_motion`` read.
        demonstration: What the motion was made from. It brings scene, stance and contacts; without
            it the motion stands on flat ground and its report has no figure that needs a source.

    Raises:
        InvalidDataError: The motion has an object and no demonstration tells which, or their
            lengths differ by more than the frame that some converters drop.
    """
    robot, frames = motion.robot, len(motion.qpos)
    owner = f"Motion {motion.path.name}"
    if demonstration is None:
        if motion.object_poses is not None:
            raise InvalidDataError(owner, "demonstration", "given: it has an object", "None")
        source, scene, stance, contacts = None, Scene(), None, None
    else:
        source = resample_source(scale_demonstration(demonstration, robot.height), motion.fps)
        if abs(source.num_frames - frames) > 1:
            raise InvalidDataError(
                owner,
                "length",
                f"that of {demonstration.name!r}, {source.num_frames} frames",
                f"{frames}",
            )
        frames = min(frames, source.num_frames)
        source = _first_frames(source, frames)
        scene, stance, contacts = source.scene, source.stance[STANCE], source.contacts
    qpos = motion.qpos[:frames]
    poses = None if motion.object_poses is None else motion.object_poses[:frames]
    return reference_from_qpos(
        robot,
        motion.fps,
        qpos,
        poses,
        scene,
        contacts,
        stance,
        report=evaluate(robot, scene, motion.fps, qpos, poses, source),
        source=source,
        provenance={
            "demonstration": demonstration.name if demonstration else motion.path.stem,
            "file": motion.path.name,
            "format": motion.format,
        },
    )


def _first_frames(source: SourceMotion, frames: int) -> SourceMotion:
    def cut(array: np.ndarray | None) -> np.ndarray | None:
        return None if array is None else array[:frames]

    return replace(
        source,
        keypoints=source.keypoints[:frames],
        object_poses=cut(source.object_poses),
        source_object_poses=cut(source.source_object_poses),
        stance={k: v[:frames] for k, v in source.stance.items()},
        contacts={k: v[:frames] for k, v in source.contacts.items()},
        contact_points={k: v[:frames] for k, v in source.contact_points.items()},
    )
