"""All metrics of a robot motion at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import InvalidDataError
from omni_envs.metrics.clearance import sole_clearance, stance_clearance
from omni_envs.metrics.contact import contact_gaps, contact_surfaces, link_distance
from omni_envs.metrics.joints import (
    joint_acceleration,
    joint_jerk,
    joint_speeds,
    joint_violation,
    velocity_violation,
)
from omni_envs.metrics.penetration import penetration
from omni_envs.metrics.playback import TARGETS, Playback, play
from omni_envs.metrics.report import ReferenceReport
from omni_envs.metrics.skating import counted_stance, slip_speed, stance_drift, support_normals
from omni_envs.retargeting import InteractionMesh
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.robots import Robot
from omni_envs.scenes import Scene


def evaluate(
    robot: Robot,
    scene: Scene,
    fps: float,
    qpos: np.ndarray,
    object_poses: np.ndarray | None = None,
    source: SourceMotion | None = None,
    *,
    relaxed: np.ndarray | None = None,
) -> ReferenceReport:
    """Evaluates a robot motion on every frame, against true geometry.

    Works for any motion of any robot. With ``source`` it also says how well the motion follows it:
    stance sets and the slip in them, contact, keypoints, energy.

    Args:
        robot: The robot.
        scene: Its surroundings; the object at true size.
        fps: Frames per second.
        qpos: (T, 7 + n) configurations: root position, quaternion wxyz, hinges in model order.
        object_poses: (T, 7) position and quaternion wxyz where the scene has an object.
        source: The demonstration at the robot's scale and at the same frames.
        relaxed: (T,) bool: frames on which the solver gave a constraint up, if that is known.

    Returns:
        Per-frame figures; ``.summary()`` condenses them.

    Raises:
        InvalidDataError: Arrays do not fit the robot, the scene or the source, or are not finite.
    """
    playback = play(robot, scene, fps, qpos, object_poses)
    joints = playback.qpos[:, 7:]
    speeds = joint_speeds(joints, fps)
    soles, normals = playback.soles(), support_normals(playback)
    report = ReferenceReport(
        fps=float(fps),
        penetration=penetration(playback, scene),
        joint_violation=joint_violation(robot, joints),
        velocity_violation=velocity_violation(robot, speeds),
        joint_speed=speeds.max(axis=1),
        joint_acceleration=joint_acceleration(joints, fps),
        joint_jerk=joint_jerk(joints, fps),
        slip=slip_speed(soles, normals, fps),
        relaxed=None if relaxed is None else np.asarray(relaxed, bool),
    )
    return report if source is None else _follow(report, playback, scene, object_poses, source)


def _follow(
    report: ReferenceReport,
    playback: Playback,
    scene: Scene,
    object_poses: np.ndarray | None,
    source: SourceMotion,
) -> ReferenceReport:
    """Adds what needs the source."""
    owner = f"Source {source.name!r}"
    if source.num_frames != playback.num_frames:
        raise InvalidDataError(
            owner, "frames", f"{playback.num_frames}, as the motion", str(source.num_frames)
        )
    if not np.isclose(source.fps, playback.fps):
        raise InvalidDataError(owner, "fps", f"{playback.fps}, as the motion", str(source.fps))
    if (source.object_poses is None) != (object_poses is None):
        raise InvalidDataError(owner, "object_poses", "given as for the motion", "only one of two")
    soles, normals = playback.soles(), support_normals(playback)
    drift = {
        mode: stance_drift(soles, normals, flags, source.pivots(flags))
        for mode, flags in source.stance.items()
    }
    clearance = sole_clearance(playback, normals)
    flat = {mode: HumanFeet.of(source, flags) for mode, flags in source.stance.items()}
    links = tuple(source.contacts)
    keypoints = playback.keypoints()
    error = np.linalg.norm(keypoints - source.keypoints, axis=-1).mean(axis=1)
    mesh = InteractionMesh.of(replace(source, object_poses=object_poses))
    points = {k: np.asarray(v, float) for k, v in source.contact_points.items() if k in links}
    return replace(
        report,
        stance={mode: counted_stance(flags) for mode, flags in source.stance.items()},
        drift={mode: centre for mode, (centre, _, _) in drift.items()},
        still_drift={mode: still for mode, (_, still, _) in drift.items()},
        pivot_drift={mode: pivot for mode, (_, _, pivot) in drift.items()},
        clearance={
            mode: stance_clearance(clearance, human.flat & ~human.pivots, playback.fps)
            for mode, human in flat.items()
        },
        contact={link: np.asarray(source.contacts[link], bool) for link in links},
        contact_distance={k: link_distance(playback, k, contact_surfaces(scene, k)) for k in links},
        contact_depth={k: np.maximum(0.0, -link_distance(playback, k, TARGETS)) for k in links},
        contact_gap=contact_gaps(playback, points, object_poses),
        keypoint_error=error,
        energy=mesh.energy(keypoints),
    )
