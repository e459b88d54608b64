"""The columns of the OmniRetarget table, as its published evaluator computes them.

Not what the headings suggest: speeds are per frame of a 30 fps clip, "max depth" and "max velocity"
are means over the frames beyond a threshold, 1 cm of depth is no penetration, and 30 cm/s is no
slip. Kept to compare with published figures; ``evaluate`` has the true ones. The published
evaluator's terrain contact is left out: it cannot fail, a robot 50 m away scores 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omni_envs.demonstrations import Demonstration
from omni_envs.errors import InvalidDataError
from omni_envs.metrics.penetration import penetration
from omni_envs.metrics.playback import SELF, play
from omni_envs.robots import KEYPOINTS, SIDES, Robot
from omni_envs.scenes import Scene

PENETRATING = 0.01
"""Depth that counts, m."""
MOVING = 0.01
"""Horizontal move that ends a stance and counts as slide, m per frame at ``PAPER_FPS``."""
PAPER_FPS = 30.0
HANDLING = 0.28
"""Distance of a hand from the origin of the object that counts as contact, m at true scale."""


@dataclass(frozen=True, eq=False)
class PaperFigures:
    """One motion as the published evaluator sees it.

    Attributes:
        frames: T.
        depths: Depth of every penetrating frame, m.
        slides: Fastest sliding toe of every sliding frame, m per frame at 30 fps.
        stance_frames: Frames with a planted foot, None without a demonstration.
        contact: Share of the frames without a lost hand, None without object or demonstration.
    """

    frames: int
    depths: np.ndarray
    slides: np.ndarray
    stance_frames: int | None
    contact: float | None

    @property
    def penetration_duration(self) -> float:
        """Penetrating frames / all frames."""
        return len(self.depths) / self.frames

    @property
    def skating_duration(self) -> float | None:
        """Sliding frames / frames with a planted foot."""
        return len(self.slides) / self.stance_frames if self.stance_frames else None


def paper_figures(
    robot: Robot,
    scene: Scene,
    fps: float,
    qpos: np.ndarray,
    object_poses: np.ndarray | None = None,
    demonstration: Demonstration | None = None,
) -> PaperFigures:
    """Evaluates a motion like the published evaluator.

    A foot of an object clip is planted by the speed of the **unscaled** human's toe, else by that
    of the scaled one. Rates other than 30 fps are converted, so that thresholds mean the same
    speed.

    Args:
        robot: The robot.
        scene: Its surroundings.
        fps: Frames per second.
        qpos: (T, 7 + n) configurations.
        object_poses: (T, 7) where the scene has an object.
        demonstration: What the motion follows, at the same frames and human scale.

    Raises:
        InvalidDataError: Arrays do not fit the robot, the scene or the demonstration.
    """
    playback = play(robot, scene, fps, qpos, object_poses)
    targets = [d for name, d in penetration(playback, scene).items() if name != SELF]
    depth = np.max(targets, axis=0)
    slides, stance_frames, contact = np.zeros(0), None, None
    if demonstration is not None:
        if demonstration.num_frames != playback.num_frames:
            raise InvalidDataError(
                f"Demonstration {demonstration.name!r}",
                "frames",
                f"{playback.num_frames}, as the motion",
                str(demonstration.num_frames),
            )
        keypoints = playback.keypoints()
        toes = [KEYPOINTS.index(f"{side}_toe") for side in SIDES]
        rate = fps / PAPER_FPS
        size = 1.0 if scene.object is not None else robot.height / demonstration.height
        planted = rate * _steps(size * demonstration.keypoints[:, toes]) <= MOVING
        planted[0] = False
        steps = rate * _steps(keypoints[:, toes])
        sliding = planted & (steps > MOVING)
        slides = np.where(sliding, steps, 0.0).max(axis=1)[sliding.any(axis=1)]
        stance_frames = int(planted.any(axis=1).sum())
        if object_poses is not None and demonstration.object_poses is not None:
            held = _near_hands(demonstration.keypoints, demonstration.object_poses)
            lost = held & ~_near_hands(keypoints, object_poses)
            contact = 1.0 - float(np.mean(lost.any(axis=1)))
    return PaperFigures(len(depth), depth[depth > PENETRATING], slides, stance_frames, contact)


def paper_row(motions: Sequence[PaperFigures]) -> dict[str, tuple[float, float] | None]:
    """Pools motions to one row of the table: column to mean and standard deviation.

    Durations and contact are means over motions; depth (cm) and speed (cm per frame) over all
    frames that have one. None where no motion has a value.
    """
    columns: dict[str, list[float]] = {
        "penetration_duration": [m.penetration_duration for m in motions],
        "penetration_depth_cm": [100 * d for m in motions for d in m.depths],
        "skating_duration": [m.skating_duration for m in motions if m.skating_duration is not None],
        "skating_speed_cm_per_frame": [100 * s for m in motions for s in m.slides],
        "contact": [m.contact for m in motions if m.contact is not None],
    }
    return {k: (float(np.mean(v)), float(np.std(v))) if v else None for k, v in columns.items()}


def _steps(points: np.ndarray) -> np.ndarray:
    """(T, K) horizontal moves of (T, K, 3) points since the previous frame, 0 on the first."""
    steps = np.zeros(points.shape[:2])
    steps[1:] = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=-1)
    return steps


def _near_hands(keypoints: np.ndarray, object_poses: np.ndarray) -> np.ndarray:
    """(T, 2) the hands that are near the origin of the object."""
    hands = [KEYPOINTS.index(f"{side}_hand") for side in SIDES]
    offsets = keypoints[:, hands] - object_poses[:, None, :3]
    return np.linalg.norm(offsets, axis=-1) <= HANDLING
