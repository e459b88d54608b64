"""A demonstration at robot scale: what the retargeter follows and what the metrics compare with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from omni_envs.demonstrations.contact import object_contacts, terrain_contacts
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.footing import knee_floor
from omni_envs.demonstrations.stance import (
    STANCE_MODES,
    lying_feet,
    pivot_schedule,
    stance_schedule,
)
from omni_envs.errors import InvalidOptionError
from omni_envs.robots import KEYPOINTS, SIDES
from omni_envs.scenes import Scene

MAT_HEIGHT = 0.1
"""Toes that never come lower than this stand on a mat of this height, m (human scale)."""

_FOOT = ("toe", "ankle")


@dataclass(frozen=True, eq=False)
class SourceMotion:
    """A demonstration scaled to a robot's height, with its stance and contact schedules.

    The human shrinks by α about the world origin, and terrain with it. The object keeps its true
    size in the target scene, while the *source* mesh sees it shrunk by α at the same pose.

    Attributes:
        name: Name of the demonstration.
        fps: Frames per second.
        scale: α = robot height / human height.
        keypoints: (T, 15, 3) scaled keypoints in the order of ``KEYPOINTS``, m.
        scene: Target scene: the object at true size, terrain scaled.
        object_poses: (T, 7) object pose in the target scene, or None.
        source_object_poses: (T, 7) pose of the object shrunk by ``scale`` in the scaled source, or
            None.
        stance: Stance mode to (T, 2) bool, left and right foot: ``"text"`` (≤ 0.01 m/s),
            ``"default"`` (≤ 0.10 m/s with hysteresis), ``"code"`` (≤ 0.30 m/s). See ``stance.py``.
        contacts: Link of ``CONTACT_LINKS`` to (T,) bool, where the human touches object or terrain.
        contact_points: Link to (T, 3) point of the surface that the human touches, in the frame of
            the true-size object (object contact) or in the world (terrain contact), NaN without
            contact.
        original_scene: The target scene before a variation gave object or terrain another shape,
            or None. Faces of its surfaces correspond one to one.
        mesh_object_poses: (T, 7) pose of the object that the interaction mesh sees in the target
            scene, where a variation makes it another than ``object_poses``; or None.
    """

    name: str
    fps: float
    scale: float
    keypoints: np.ndarray
    scene: Scene
    object_poses: np.ndarray | None
    source_object_poses: np.ndarray | None
    stance: Mapping[str, np.ndarray]
    contacts: Mapping[str, np.ndarray] = field(default_factory=dict)
    contact_points: Mapping[str, np.ndarray] = field(default_factory=dict)
    original_scene: Scene | None = None
    mesh_object_poses: np.ndarray | None = None

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.keypoints)

    def pivots(self, stance: np.ndarray) -> np.ndarray:
        """When the human's standing feet roll or turn on their toes: see ``pivot_schedule``.

        Args:
            stance: (T, 2) bool, left and right foot.

        Returns:
            (T, 2) bool.
        """
        columns = []
        for side, name in enumerate(SIDES):
            toe, ankle = (self.keypoints[:, KEYPOINTS.index(f"{name}_{p}")] for p in _FOOT)
            columns.append(pivot_schedule(ankle - toe, stance[:, side], self.fps))
        return np.column_stack(columns)


def scale_demonstration(demonstration: Demonstration, robot_height: float) -> SourceMotion:
    """Scales a demonstration to a robot, as OmniRetarget's preprocessing does.

    With α = robot height / human height:

    * joints: lowered so that the lowest toe joint of the clip is at z = 0 (less a 0.1 m mat when no
      toe comes below 0.1 m), then × α. The toe joint of the human becomes the sole of the robot.
      Someone who crawls may never put a toe flat: ``knee_floor`` counts too.
    * terrain × α, not lowered: what counts is that the toes meet the surface. Keypoints, stance and
      contact all use the same lowered joints.
    * object: size kept; x, y × α; the height of the first frame is kept and only its changes are
      × α, so an object that rests on the ground still does; orientation kept. The source mesh sees
      the object shrunk by α at this same pose.
    * contact with an object is taken where there is one, else contact with terrain and ground.

    Args:
        demonstration: At human scale.
        robot_height: Standing height of the robot, m.

    Raises:
        InvalidOptionError: The height is not positive.
    """
    if not 0 < robot_height < np.inf:
        raise InvalidOptionError(f"robot_height must be positive (m); got {robot_height}.")
    scale = robot_height / demonstration.height
    toes = [KEYPOINTS.index("left_toe"), KEYPOINTS.index("right_toe")]
    floor = demonstration.keypoints[:, toes, 2].min()
    if floor >= MAT_HEIGHT:
        floor -= MAT_HEIGHT
    knees = [KEYPOINTS.index("left_knee"), KEYPOINTS.index("right_knee")]
    floor = min(floor, knee_floor(demonstration.keypoints[:, knees], demonstration.fps))
    offset = np.array([0.0, 0.0, floor])
    keypoints = scale * (demonstration.keypoints - offset)
    scene, poses = demonstration.scene, demonstration.object_poses
    terrain = scene.terrain.scaled(scale) if scene.terrain is not None else None
    if poses is not None:
        first = poses[0, 2]
        poses = np.concatenate([scale * poses[:, :3], poses[:, 3:]], axis=1)
        poses[:, 2] += (1 - scale) * first
        contacts, points = object_contacts(demonstration)
    else:
        positions = scale * (demonstration.positions - offset)
        contacts, points = terrain_contacts(demonstration, positions, terrain, scale)
    ankles = [KEYPOINTS.index("left_ankle"), KEYPOINTS.index("right_ankle")]
    feet = keypoints[:, ankles] - keypoints[:, toes]
    lying = np.column_stack([lying_feet(feet[:, side]) for side in range(2)])
    stance: dict[str, np.ndarray] = {
        mode: ~lying
        & np.column_stack(
            [stance_schedule(keypoints[:, toe], demonstration.fps, mode) for toe in toes]
        )
        for mode in STANCE_MODES
    }
    return SourceMotion(
        name=demonstration.name,
        fps=demonstration.fps,
        scale=scale,
        keypoints=keypoints,
        scene=replace(scene, terrain=terrain),
        object_poses=poses,
        source_object_poses=poses,
        stance=stance,
        contacts=contacts,
        contact_points=points,
    )
