"""From a demonstration to a reference: scale, resample, retarget, refine, evaluate."""

from __future__ import annotations

import warnings
from dataclasses import asdict, replace

import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations import Demonstration, scale_demonstration
from omni_envs.demonstrations.jumps import SPEED, find_jumps
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.demonstrations.source_resampling import resample_source
from omni_envs.demonstrations.variation import Variation
from omni_envs.demonstrations.varied import vary
from omni_envs.errors import InvalidDataError
from omni_envs.metrics import ReferenceReport, evaluate, missed_contacts
from omni_envs.metrics.playback import TARGETS, play
from omni_envs.progress import ProgressCallback
from omni_envs.references.formats.motion import RATES, is_rate
from omni_envs.references.key import content_hashes, reference_key, versions
from omni_envs.references.kinematics import reference_from_qpos
from omni_envs.references.reference import Reference
from omni_envs.retargeting import RetargetOptions, refine, retarget
from omni_envs.robots import KEYPOINTS, Robot, get_robot
from omni_envs.scenes import OBJECT
from omni_envs.threads import one_maths_thread_here

STANCE = "default"
"""The stance set that a reference carries as its schedule."""

# How deep (m) a variation may put the object into the ground, and into the nominal robot.
_START_DEPTH, _START_OVERLAP = 2e-3, 0.05

_START_LEFT = 5e-3
"""How deep (m) the robot of a variation may be in its surroundings on the first frame made."""


def make_reference(
    demonstration: Demonstration,
    robot: str | Robot,
    *,
    fps: float = 50.0,
    options: RetargetOptions | None = None,
    variation: Variation | None = None,
    nominal: Reference | None = None,
    progress: ProgressCallback | None = None,
) -> Reference:
    """Makes a reference from a demonstration, with its proof.

    Args:
        demonstration: The human motion.
        robot: The robot or its name.
        fps: Frames per second of the reference.
        options: Settings of the retargeter.
        variation: How the scene differs from that of the demonstration. The motion is then anchored
            to the nominal one: where the object was changed, for the options' ``nominal_decay``;
            where the terrain was, all the time.
        nominal: For a variation, the reference of the unchanged scene with the same robot and rate;
            made here where it is not given.
        progress: Called with (frames done, frames in all) while retargeting.

    Raises:
        UnknownNameError: No such robot.
        InvalidDataError: The rate is not 1 to 1000, the demonstration cannot be used, or the
            variation puts object or terrain into the robot, or the object into the ground, at the
            start.
        InvalidOptionError: The variation changes what the scene lacks.
    """
    robot, options = get_robot(robot), options or RetargetOptions()
    variation = variation or Variation()
    varied, settings = variation != Variation(), options
    if not is_rate(fps):
        raise InvalidDataError("Reference", "fps", RATES, str(fps))
    # The source is resampled, not the result: so the retargeter holds every constraint on every
    # frame of the reference, and interpolation cannot break one.
    source = scale_demonstration(demonstration, robot.height)
    _warn_of_jumps(source)
    source = resample_source(source, fps)
    passes = 2 if options.refine else 1
    anchor = None
    if varied:
        if nominal is None:
            nominal = make_reference(demonstration, robot, fps=fps, options=options)
        anchor, original = nominal.qpos, source
        source = vary(original, variation)
        if variation.shapes_terrain:
            options = replace(options, nominal_decay=None)
        _check_ground(original, source)
        _check_robot(robot, source, anchor)
    with one_maths_thread_here():
        motion = retarget(
            source, robot, options, _share(progress, source.num_frames, 0, passes), nominal=anchor
        )
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
    if varied:
        _check_start(source, report)
    _warn_of_misses(source, robot, report)
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
            "demonstration": motion.source.name,
            "source": demonstration.source,
            "licence": demonstration.licence,
            "robot": robot.name,
            "options": asdict(options),
            "fps": float(fps),
            "variation": asdict(variation) if varied else None,
            "versions": versions(),
            "hashes": content_hashes(demonstration, robot, fps, settings, variation),
            "key": reference_key(demonstration, robot, fps, settings, variation),
            "solved_frames": motion.num_frames,
            "solve_seconds": float(motion.frames.seconds.sum()),
        },
    )


def _warn_of_jumps(source: SourceMotion) -> None:
    """Limits on speed keep the robot from jumping along, so nothing in its report would tell."""
    jumps = find_jumps(source.keypoints, source.fps, source.scale)
    if len(jumps):
        frames = np.unique(jumps[:, 0])
        joints = ", ".join(KEYPOINTS[j] for j in np.unique(jumps[:, 1]))
        shown = ", ".join(map(str, frames[:8].tolist())) + (", …" if len(frames) > 8 else "")
        warnings.warn(
            f"Demonstration {source.name!r} jumps to frame {shown} ({joints}; faster than "
            f"{SPEED:g} m/s): swapped markers or lost frames? The reference goes astray there.",
            stacklevel=3,
        )


def _warn_of_misses(source: SourceMotion, robot: Robot, report: ReferenceReport) -> None:
    """A mean gap tells little of a hand that the robot's arm is too short for."""
    if misses := missed_contacts(report):
        shown = ", ".join(map(str, misses[:4])) + (", …" if len(misses) > 4 else "")
        warnings.warn(
            f"{robot.title} does not reach what the human touches in {source.name!r}: {shown}.",
            stacklevel=3,
        )


def _check_ground(nominal: SourceMotion, varied: SourceMotion) -> None:
    """Refuses a variation that starts with the object in the ground.

    Recordings may start with it a few millimetres deep; what counts is what is added.
    """
    before, after = (_depth_in_ground(motion) for motion in (nominal, varied))
    if after > max(before, 0.0) + _START_DEPTH:
        raise InvalidDataError(
            f"Variation {varied.name!r}",
            "object",
            "above the ground at the start",
            f"{100 * after:.1f} cm in it",
        )


def _depth_in_ground(source: SourceMotion) -> float:
    if source.scene.object is None or source.object_poses is None:
        return 0.0
    pose = source.object_poses[0]
    corners = np.asarray(source.scene.object.surface().vertices)
    turned = rotations.rotate(pose[3:], corners)
    return -float(pose[2] + turned[:, 2].min())


def _check_robot(robot: Robot, varied: SourceMotion, qpos: np.ndarray) -> None:
    """Refuses a variation that puts the object where the nominal robot stands at the start.

    A little is for the solver to resolve: the robot leans back or steps aside.
    """
    if varied.scene.object is None or varied.object_poses is None:
        return
    start = play(robot, varied.scene, varied.fps, qpos[:1], varied.object_poses[:1])
    depth = np.where(start.target == TARGETS.index(OBJECT), -start.distance, -np.inf)
    if depth.max(initial=0.0) > _START_OVERLAP:
        deepest = int(np.argmax(depth))
        raise InvalidDataError(
            f"Variation {varied.name!r}",
            "object",
            "outside of the robot at the start",
            f"{100 * depth[deepest]:.1f} cm in {start.body_names[start.body[deepest]]}",
        )


def _check_start(varied: SourceMotion, report: ReferenceReport) -> None:
    """Refuses a variation that leaves the robot no place to start: a terrain that grew over it."""
    depth = float(report.surroundings_penetration[0])
    if depth > _START_LEFT:
        raise InvalidDataError(
            f"Variation {varied.name!r}",
            "scene",
            "one in which the robot can start outside of object, terrain and ground",
            f"{100 * depth:.1f} cm in it",
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
