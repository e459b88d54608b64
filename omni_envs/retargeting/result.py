"""What retargeting returns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.options import RetargetOptions

RELAXATIONS = ("stance", "self_collision", "penetration")
"""Constraints that may give way where they contradict each other, the first to give way first.

Speed limits would come next, joint limits never: a frame that stays as the last one satisfies both,
so neither can contradict anything, and both hold on every frame even where all others give way.
"""

# Stance windows are wider than what counts as relaxed by this much: numerical slack of the last
# step.
_RELAXED = 2e-4


def relaxation_tolerance(options: RetargetOptions) -> float:
    """Violation from which on a frame counts as relaxed, m."""
    return max(_RELAXED, options.restoration_tolerance)


@dataclass(frozen=True, eq=False)
class SolveRecord:
    """What happened on every frame.

    Attributes:
        energy: (T,) deformation energy, weight 1, m².
        iterations: (T,) quadratic programs solved.
        relaxed: (T,) a constraint is violated by more than its tolerance in the result.
        violations: Name in ``RELAXATIONS`` to (T,) remaining violation in the result, m.
        seconds: (T,) solve time.
    """

    energy: np.ndarray
    iterations: np.ndarray
    relaxed: np.ndarray
    violations: dict[str, np.ndarray] = field(default_factory=dict)
    seconds: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False)
class Retargeted:
    """A robot motion that follows a source.

    Attributes:
        robot: Name of the robot.
        fps: Frames per second.
        qpos: (T, 7 + n) robot configurations: position, quaternion wxyz, hinges in model order.
        object_poses: (T, 7) object poses, or None.
        source: What it follows, at the same ``fps``.
        options: Settings it was made with.
        frames: What happened on every frame.
        nominal: (T, 7 + n) motion that it was anchored to, or None.
    """

    robot: str
    fps: float
    qpos: np.ndarray
    object_poses: np.ndarray | None
    source: SourceMotion
    options: RetargetOptions
    frames: SolveRecord
    nominal: np.ndarray | None = None

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.qpos)
