"""From a demonstration to a reference: scale, resample, retarget, refine, evaluate."""

from __future__ import annotations

from dataclasses import asdict

from omni_envs.demonstrations import Demonstration, scale_demonstration
from omni_envs.demonstrations.source_resampling import resample_source
from omni_envs.errors import InvalidDataError
from omni_envs.metrics import ReferenceReport, evaluate
from omni_envs.progress import ProgressCallback
from omni_envs.references.key import content_hashes, reference_key, versions
from omni_envs.references.kinematics import reference_from_qpos
from omni_envs.references.reference import Reference
from omni_envs.retargeting import RetargetOptions, refine, retarget
from omni_envs.robots import Robot, get_robot

STANCE = "default"
"""The stance set that a reference carries as its schedule."""


def make_reference(
    demonstration: Demonstration,
    robot: str | Robot,
    *,
    fps: float = 50.0,
    options: RetargetOptions | None = None,
    progress: ProgressCallback | None = None,
) -> Reference:
    """Makes a reference from a demonstration, with its proof.

    Args:
        demonstration: The human motion.
        robot: The robot or its name.
        fps: Frames per second of the reference.
        options: Settings of the retargeter.
        progress: Called with (frames done, frames in all) while retargeting.

    Raises:
        UnknownNameError: No such robot.
        InvalidDataError: The rate is not positive, or the demonstration cannot be used.
    """
    robot, options = get_robot(robot), options or RetargetOptions()
    if not 0 < fps < float("inf"):
        raise InvalidDataError("Reference", "fps", "positive", str(fps))
    # The source is resampled, not the result: so the retargeter holds every constraint on every
    # frame of the reference, and interpolation cannot break one.
    source = resample_source(scale_demonstration(demonstration, robot.height), fps)
    passes = 2 if options.refine else 1
    motion = retarget(source, robot, options, _share(progress, source.num_frames, 0, passes))
    if options.refine:
        motion = refine(motion, progress=_share(progress, source.num_frames, 1, passes))
    report = evaluate(
        robot,
        motion.source.scene,
        motion.fps,
        motion.qpos,
        motion.object_poses,
        motion.source,
        relaxed=motion.frames.relaxed,
    )
    return reference_from_qpos(
        robot,
        motion.fps,
        motion.qpos,
        motion.object_poses,
        motion.source.scene,
        contacts=motion.source.contacts,
        stance=motion.source.stance[STANCE],
        report=report,
        source=motion.source,
        provenance={
            "demonstration": demonstration.name,
            "source": demonstration.source,
            "licence": demonstration.licence,
            "robot": robot.name,
            "options": asdict(options),
            "fps": float(fps),
            "versions": versions(),
            "hashes": content_hashes(demonstration, robot, fps, options),
            "key": reference_key(demonstration, robot, fps, options),
            "solved_frames": motion.num_frames,
            "solve_seconds": float(motion.frames.seconds.sum()),
        },
    )


def _share(
    progress: ProgressCallback | None, frames: int, number: int, passes: int
) -> ProgressCallback | None:
    """One of several passes over all frames, on a bar that counts frames once."""
    if progress is None:
        return None

    def update(done: int, total: int) -> None:
        progress(int(frames * (number + done / total) / passes), frames)

    return update


def evaluate_reference(reference: Reference) -> ReferenceReport:
    """Evaluates a reference anew; only what its solver gave up is taken from its own report.

    Raises:
        UnknownNameError: Its robot is not registered.
    """
    return evaluate(
        get_robot(reference.robot),
        reference.scene,
        reference.fps,
        reference.qpos,
        reference.object_poses,
        reference.source,
        relaxed=None if reference.report is None else reference.report.relaxed,
    )
