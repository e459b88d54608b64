"""Staying near a nominal motion while the surroundings change (OmniRetarget, section III-B).

An interaction mesh alone follows a moved object rigidly: the whole robot moves with it. Anchoring
base and legs to the motion that was made for the unchanged scene leaves the adaptation to the rest.
"""

from __future__ import annotations

import numpy as np

from omni_envs.errors import InvalidDataError
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.proximal_task import ProximalTask
from omni_envs.robots import Robot


def nominal_weights(
    configuration: Kinematics, options: RetargetOptions, frames: int, fps: float
) -> np.ndarray:
    """(T, nv) weights of ½ w_i (q ⊖ q_nominal)_i²: base and legs, fading with time.

    Legs are all joints between root and feet, a waist among them where the root is above it. On
    frame t: w·exp(-t / (fps τ)) in the metric S.

    Args:
        configuration: Kinematics of the robot.
        options: Weight and decay.
        frames: T.
        fps: Frames per second.
    """
    feet = [configuration.model.body(foot.body).id for foot in configuration.robot.feet.values()]
    lower = configuration.ancestors[feet].max(axis=0)
    decay = options.nominal_decay
    fading = np.ones(frames) if decay is None else np.exp(-np.arange(frames) / (fps * decay))
    return options.nominal_weight * fading[:, None] * (lower * configuration.metric)


def check_nominal(robot: Robot, qpos: np.ndarray, frames: int) -> np.ndarray:
    """Returns the (T, 7 + n) nominal configurations.

    Raises:
        InvalidDataError: They are not of this robot, not one per frame, or not finite.
    """
    owner, expected = f"Nominal motion of {robot.name!r}", (frames, robot.nq)
    qpos = np.asarray(qpos, float)
    if qpos.shape != expected:
        raise InvalidDataError(owner, "qpos", f"of shape {expected}", str(qpos.shape))
    if not np.isfinite(qpos).all():
        first = tuple(int(i) for i in np.argwhere(~np.isfinite(qpos))[0])
        raise InvalidDataError(owner, "qpos", "finite", f"NaN or infinity first at {first}")
    return qpos


class NominalTask(ProximalTask):
    """½ Σ_i w_i(t) (q ⊖ q_nominal(t))_i².

    Args:
        qpos: (T, nq) nominal configurations.
        weights: (T, nv) weights, see ``nominal_weights``.
    """

    def __init__(self, qpos: np.ndarray, weights: np.ndarray) -> None:
        super().__init__(weights[0])
        self._qpos, self._all_weights = qpos, weights
        self.set_frame(0)

    def set_frame(self, t: int) -> None:
        """Chooses a frame of the nominal motion."""
        self._weights = self._all_weights[t]
        self.set_target(self._qpos[t])
