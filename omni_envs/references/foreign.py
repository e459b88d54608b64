"""References out of motions that other projects made, so that all are judged alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from omni_envs.demonstrations import Demonstration, SourceMotion, scale_demonstration
from omni_envs.demonstrations.source_resampling import resample_source
from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.metrics import evaluate
from omni_envs.references.build import STANCE
from omni_envs.references.formats import ForeignMotion, load_motion
from omni_envs.references.kinematics import reference_from_qpos
from omni_envs.references.npz import read_npz
from omni_envs.references.reference import Reference
from omni_envs.robots import Robot
from omni_envs.scenes import Scene


def open_reference(
    path: str | Path,
    robot: str | Robot = "g1",
    demonstration: Demonstration | None = None,
    *,
    scene: Scene | None = None,
    fps: float | None = None,
) -> Reference:
    """Opens a reference of ours, or completes a robot motion of another project to one.

    Args:
        path: A file that ``Reference.save`` wrote, or any that ``load_motion`` reads.
        robot: The robot of a foreign motion.
        demonstration: What a foreign motion was made from; a reference brings its own.
        scene: Object and terrain of a foreign motion, at robot scale, where no demonstration brings
            them.
        fps: Frames per second of a foreign motion whose file does not tell.

    Raises:
        FileFormatError: The file is neither, or damaged.
        InvalidDataError: The foreign motion does not fit robot, demonstration or scene.
        InvalidOptionError: Something was given that the file brings itself.
    """
    path = Path(path)
    if path.suffix != ".csv" and "format" in read_npz(path, checked=False):
        for name, value in (("scene", scene), ("fps", fps)):
            if value is not None:
                raise InvalidOptionError(f"{name}: the reference {path} brings its own.")
        return Reference.load(path)
    return reference_from_motion(load_motion(path, robot, fps=fps), demonstration, scene)


def reference_from_motion(
    motion: ForeignMotion,
    demonstration: Demonstration | None = None,
    scene: Scene | None = None,
) -> Reference:
    """Completes a foreign motion to a reference: velocities from its poses, scene, source, report.

    Args:
        motion: What ``load_motion`` read.
        demonstration: What the motion was made from. It brings scene, stance and contacts; without
            it the report has no figure that needs a source.
        scene: Object and terrain at robot scale; without demonstration and scene the motion stands
            on flat ground.

    Raises:
        InvalidDataError: The motion has an object and nothing tells which, or the reverse, or the
            lengths of motion and demonstration differ by more than the frame that some converters
            drop.
        InvalidOptionError: Demonstration and scene are both given.
    """
    robot, frames = motion.robot, len(motion.qpos)
    owner = f"Motion {motion.path.name}"
    if demonstration is not None and scene is not None:
        raise InvalidOptionError("scene: the demonstration brings it; give one of the two.")
    if demonstration is None:
        scene = scene or Scene()
        if (motion.object_poses is None) != (scene.object is None):
            expected, found = ("an object", "none") if scene.object is None else ("none", "one")
            raise InvalidDataError(
                owner, "scene (or demonstration)", f"one with {expected}, as the motion", found
            )
        source, stance, contacts = None, None, None
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
        mesh_object_poses=cut(source.mesh_object_poses),
        stance={k: v[:frames] for k, v in source.stance.items()},
        contacts={k: v[:frames] for k, v in source.contacts.items()},
        contact_points={k: v[:frames] for k, v in source.contact_points.items()},
    )
