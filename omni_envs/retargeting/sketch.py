"""A motion through walls: every few frames, without stance and without the surroundings.

Frame by frame, a limb that hangs on the wrong side of an edge stays there, though it would be far
better off beyond it. A robot that nothing stops is never caught. Where it puts its feet, footholds
are planned; where it is far better off, a frame is solved from its pose once more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.stance_plan import FootWishes, foot_wishes
from omni_envs.robots import KEYPOINTS, SIDES

_STRIDE = 5
# A frame is caught if it costs this many times the sketch and this much more (m² times weights).
_CAUGHT, _AT_LEAST = 1.3, 0.05


def sketched_frames(frames: int) -> np.ndarray:
    """(K,) frames of a motion to draw: every fifth, and the last."""
    return np.unique(np.append(np.arange(0, frames, _STRIDE), frames - 1))


@dataclass(frozen=True, eq=False)
class Sketch:
    """The drawn frames.

    Attributes:
        frames: (K,) which, ascending from 0 to the last of the motion.
        qpos: (K, nq) configurations.
        feet: (K, 2, 3, 3) as ``Kinematics.feet`` returns them.
        costs: (K,) mesh and contacts.
    """

    frames: np.ndarray
    qpos: np.ndarray
    feet: np.ndarray
    costs: np.ndarray

    def drawn(self, t: int) -> int | None:
        """Number of frame t among the drawn ones, None where it is not."""
        k = int(np.searchsorted(self.frames, t))
        return k if self.frames[k] == t else None

    def catches(self, k: int, cost: float) -> bool:
        """Whether drawn frame k costs so much more than here that it must be caught somewhere."""
        return bool(cost > _CAUGHT * self.costs[k] + _AT_LEAST)

    def foot_wishes(self, source: SourceMotion) -> FootWishes:
        """Where the feet would be on every frame of the source."""
        wishes = foot_wishes(self.feet)
        # Between the drawn frames they follow the human's toes: the offset changes slowly.
        human = source.keypoints[:, [KEYPOINTS.index(f"{side}_toe") for side in SIDES], :2]
        return FootWishes(
            human + self._between(wishes.tips - human[self.frames]),
            self._between(wishes.headings),
            self._between(wishes.reach),
            self._between(wishes.lying),
            wishes.length,
        )

    def _between(self, values: np.ndarray) -> np.ndarray:
        """Linear interpolation of (K, …) values to all frames."""
        at = np.arange(self.frames[-1] + 1)
        flat = values.reshape(len(self.frames), -1)
        columns = [np.interp(at, self.frames, column) for column in flat.T]
        return np.stack(columns, axis=1).reshape(len(at), *values.shape[1:])
