"""Matching the orientations of human links: the interaction mesh alone knows points only."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omni_envs import rotations
from omni_envs.retargeting.human_frames import HUMAN_BODIES, estimate_frames
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.options import ORIENTED
from omni_envs.retargeting.tasks import CostTask, Quadratic
from omni_envs.robots import SIDES, Robot

_KEYPOINT = {"shin": "knee", "forearm": "elbow", "hand": "hand"}
_HUMAN = {"shin": "knee", "foot": "foot", "forearm": "elbow", "hand": "wrist"}


def oriented_bodies(robot: Robot) -> dict[str, dict[str, str]]:
    """For every name in ``ORIENTED`` the human bodies and the robot bodies that follow them."""
    bodies = {"pelvis": {"pelvis": robot.root_body}, "torso": {"torso": robot.torso_body}}
    for name in ORIENTED[2:]:
        bodies[name] = {
            f"{side}_{_HUMAN[name]}": robot.feet[side].body
            if name == "foot"
            else robot.keypoints[f"{side}_{_KEYPOINT[name]}"].body
            for side in SIDES
        }
    return bodies


class OrientationTask(CostTask):
    """½ Σ w ‖log(Rᵀ R_target)‖² over links.

    Human link frames are derived from keypoints (``estimate_frames``), those of the robot from its
    own keypoints in its default pose; a robot body keeps the turn between the two. So no table per
    robot is needed, and sources without orientations serve as well.

    Args:
        keypoints: (T, 15, 3) scaled human keypoints.
        configuration: Kinematics of the robot; its configuration changes.
        weights: Name in ``ORIENTED`` to w, per rad².
    """

    def __init__(
        self, keypoints: np.ndarray, configuration: Kinematics, weights: Mapping[str, float]
    ) -> None:
        followed = oriented_bodies(configuration.robot)
        pairs = [(h, r, w) for name, w in weights.items() for h, r in followed[name].items()]
        self._bodies = np.array([configuration.model.body(r).id for _, r, _ in pairs], int)
        self._weights = np.array([w for _, _, w in pairs])
        human = [HUMAN_BODIES.index(h) for h, _, _ in pairs]
        configuration.update(configuration.robot.default_qpos)
        own = estimate_frames(configuration.keypoints()[None])[0, human]
        turn = rotations.multiply(rotations.conjugate(own), configuration.data.xquat[self._bodies])
        self._targets = rotations.multiply(estimate_frames(keypoints)[:, human], turn)
        self._t = 0

    def set_frame(self, t: int) -> None:
        """Chooses the source frame."""
        self._t = t

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the Gauss-Newton model of the cost."""
        data = configuration.data
        now = data.xquat[self._bodies]
        error = rotations.rotate(now, rotations.difference(now, self._targets[self._t]))
        J = configuration.ancestors[self._bodies][:, None, :] * data.cdof[:, :3].T
        weighted = (self._weights[:, None, None] * J).reshape(-1, J.shape[-1])
        flat = error.ravel()
        value = 0.5 * float(self._weights @ np.square(error).sum(axis=1))
        return Quadratic(J.reshape(weighted.shape).T @ weighted, -(flat @ weighted), value)
