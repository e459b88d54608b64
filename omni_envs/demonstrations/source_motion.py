"""A demonstration at robot scale: what the retargeter follows and what the metrics compare with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from omni_envs.scenes import Scene


@dataclass(frozen=True, eq=False)
class SourceMotion:
    """A demonstration scaled to a robot's height, with its stance and contact schedules.

    The human shrinks by α about the world origin, and terrain with it. The object keeps its true size in
    the target scene, while the *source* mesh sees it shrunk by α at the shrunk pose.

    Attributes:
        name: Name of the demonstration.
        fps: Frames per second.
        scale: α = robot height / human height.
        keypoints: (T, 15, 3) scaled keypoints in the order of ``KEYPOINTS``, m.
        scene: Target scene: the object at true size, terrain scaled.
        object_poses: (T, 7) object pose in the target scene, or None.
        source_object_poses: (T, 7) pose of the object shrunk by ``scale`` in the scaled source, or None.
        stance: Stance mode to (T, 2) bool, left and right foot: ``"text"`` (≤ 0.01 m/s), ``"default"``
            (≤ 0.10 m/s with hysteresis), ``"code"`` (≤ 0.30 m/s). See ``stance.py``.
        contacts: Link of ``CONTACT_LINKS`` to (T,) bool, where the human touches object or terrain.
        contact_points: Link to (T, 3) point of the surface that the human touches, in the frame of the
            true-size object (object contact) or in the world (terrain contact), NaN without contact.
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

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.keypoints)
