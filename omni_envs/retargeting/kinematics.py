"""Kinematics of a robot in a scene: all points and Jacobians of a configuration at once."""

from __future__ import annotations

from functools import cached_property, lru_cache

import mink
import mujoco
import numpy as np
from numpy.typing import ArrayLike

from omni_envs import rotations
from omni_envs.retargeting import kernels
from omni_envs.robots import KEYPOINTS, SIDES, Foot, Robot
from omni_envs.scenes import OBJECT, Scene, distance_spec


class Points:
    """A fixed set of K points of the robot: body ids and offsets in the body frames (m)."""

    def __init__(self, model: mujoco.MjModel, bodies: list[str], offsets: ArrayLike) -> None:
        self.bodies = np.array([model.body(name).id for name in bodies])
        self.offsets = np.asarray(offsets, float).reshape(-1, 3)


def ancestor_mask(model: mujoco.MjModel) -> np.ndarray:
    """(nbody, nv) float: 1 where a degree of freedom moves a body."""
    mask = np.zeros((model.nbody, model.nv))
    for body in range(1, model.nbody):
        mask[body] = mask[model.body_parentid[body]]
        start = model.body_dofadr[body]
        mask[body, start : start + model.body_dofnum[body]] = 1.0
    return mask


class Kinematics(mink.Configuration):
    """Robot and scene at one configuration, with what tasks and limits ask for.

    ``update`` costs mj_kinematics and mj_comPos only; contacts are found when first asked for.

    Args:
        robot: The robot.
        scene: Its surroundings; the object is a mocap body, placed by ``place_object``.
        contact_distance: Contacts with the surroundings closer than this are found, m.
        self_distance: Contacts between robot bodies closer than this are found, m; None finds none.
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        contact_distance: float = 0.05,
        self_distance: float | None = 0.02,
    ) -> None:
        self.robot = robot
        self._memory: dict[str, np.ndarray] = {}
        super().__init__(_compile(robot, scene, contact_distance, self_distance))
        model = self.model
        self.ancestors = ancestor_mask(model)
        points = [robot.keypoints[k] for k in KEYPOINTS]
        self._keypoints = Points(model, [p.body for p in points], [p.offset for p in points])
        feet = [robot.feet[side] for side in SIDES]
        self._soles = Points(
            model,
            [foot.body for foot in feet for _ in foot.sole],
            np.array([p for foot in feet for p in foot.sole]),
        )
        toes = [_toes(foot) for foot in feet]
        self._toes = Points(
            model,
            [foot.body for foot, points in zip(feet, toes, strict=True) for _ in points],
            np.concatenate(toes),
        )
        self._feet = Points(
            model,
            [foot.body for foot in feet for _ in range(3)],
            np.array([point for foot in feet for point in _foot_points(foot)]),
        )
        self._root = int(model.body(robot.root_body).id)

    @cached_property
    def metric(self) -> np.ndarray:
        """(nv,) diagonal of S: ‖dq‖_S = ‖dqpos‖, since ‖δquaternion‖² = ¼‖ω‖²."""
        metric = np.ones(self.model.nv)
        metric[3:6] = 0.25
        return metric

    @cached_property
    def foot_width(self) -> float:
        """Width of the wider foot, m."""
        return max(_width(self.model, foot) for foot in self.robot.feet.values())

    def place_object(self, pose: np.ndarray) -> None:
        """Sets the (7,) object pose; takes effect at the next ``update``."""
        self.data.mocap_pos[0], self.data.mocap_quat[0] = pose[:3], pose[3:]

    def difference(self, q: np.ndarray) -> np.ndarray:
        """(nv,) tangent q ⊖ this configuration."""
        out = np.empty(self.model.nv)
        mujoco.mj_differentiatePos(self.model, out, 1.0, self.data.qpos, q)
        return out

    def step(self, dq: np.ndarray) -> np.ndarray:
        """(nq,) this configuration ⊕ dq."""
        q = self.data.qpos.copy()
        mujoco.mj_integratePos(self.model, q, dq, 1.0)
        return q

    def update(self, q: np.ndarray | None = None) -> None:
        """Moves to the (nq,) configuration q; forgets what was computed at the last one."""
        self._memory = {}
        super().update(q)

    def positions(self, points: Points) -> np.ndarray:
        """(K, 3) world positions of points."""
        data = self.data
        return kernels.positions(data.xpos, data.xmat, points.bodies, points.offsets)

    def jacobians(self, points: Points, positions: np.ndarray) -> np.ndarray:
        """(3, K, nv) Jacobians of points at (K, 3) world positions."""
        return self.body_jacobians(points.bodies, positions)

    def body_jacobians(self, bodies: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """(3, K, nv) Jacobians of (K, 3) world points that move with (K,) bodies.

        J = mask ⊙ (linear + angular × (p - com)), from the spatial axes of all degrees of freedom.
        """
        data = self.data
        return kernels.jacobians(
            data.cdof, data.subtree_com[self._root], self.ancestors, bodies, positions
        )

    def keypoints(self) -> np.ndarray:
        """(15, 3) world keypoints."""
        if "keypoints" not in self._memory:
            self._memory["keypoints"] = self.positions(self._keypoints)
        return self._memory["keypoints"]

    def keypoint_jacobians(self) -> np.ndarray:
        """(3, 15, nv) Jacobians of the keypoints."""
        return self.jacobians(self._keypoints, self.keypoints())

    def soles(self) -> np.ndarray:
        """(2, K, 3) world sole points, left foot first."""
        return self.positions(self._soles).reshape(2, -1, 3)

    def toe_heights(self, normals: np.ndarray) -> np.ndarray:
        """(2,) heights of both feet along (2, 3) normals of what they stand on, m.

        That of a foot is the height over the plane through the origin of its lowest sole point
        before the heart: the heel may hang over an edge, and rise when the foot rolls onto its
        toes.
        """
        return self._lowest_toes(normals)[0]

    def toe_height_gradients(self, normals: np.ndarray) -> np.ndarray:
        """(2, nv) gradients of what ``toe_heights`` returns."""
        _, points = self._lowest_toes(normals)
        bodies = np.zeros((2, 2), int)
        bodies[:, 1] = self._toes.bodies[:: len(self._toes.bodies) // 2]
        return self.contact_rows(bodies, points, normals)

    def _lowest_toes(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return kernels.lowest_points(self.positions(self._toes).reshape(2, -1, 3), normals)

    def feet(self) -> np.ndarray:
        """(2, 3, 3) toe tip, and arms from there to the heart of the sole and to the left.

        The heart is the mean corner. The arm to the left is 0.1 m long.
        """
        if "feet" not in self._memory:
            feet = self.positions(self._feet).reshape(2, 3, 3)
            feet[:, 1:] -= feet[:, :1]
            self._memory["feet"] = feet
        return self._memory["feet"]

    def feet_jacobians(self) -> np.ndarray:
        """(2, 3, 3, nv) Jacobians of what ``feet`` returns."""
        if "feet_jacobians" not in self._memory:
            points = self.feet().copy()
            points[:, 1:] += points[:, :1]
            jacobian = self.jacobians(self._feet, points.reshape(6, 3))
            jacobian = jacobian.reshape(3, 2, 3, -1).transpose(1, 2, 0, 3).copy()
            jacobian[:, 1:] -= jacobian[:, :1]
            self._memory["feet_jacobians"] = jacobian
        return self._memory["feet_jacobians"]

    def contact_rows(
        self, bodies: np.ndarray, points: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """(N, nv) rows n·(J₂ - J₁) of contacts at (N, 3) points between (N, 2) bodies.

        Args:
            bodies: First and second body of each contact.
            points: Where they touch.
            normals: From the first to the second body.
        """
        data = self.data
        return kernels.contact_rows(
            data.cdof, data.subtree_com[self._root], self.ancestors, bodies, points, normals
        )


def _toes(foot: Foot) -> np.ndarray:
    """(K, 3) sole points before the heart, body frame."""
    sole = np.array(foot.sole)
    heart = sole[:-1].mean(axis=0)
    return sole[(sole - heart) @ (sole[-1] - heart) > 0.0]


def _foot_points(foot: Foot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Toe tip, heart of the sole, and the point 0.1 m to the left of the tip; body frame, z up."""
    sole = np.array(foot.sole)
    tip, heart = sole[-1], sole[:-1].mean(axis=0)
    forward = tip - heart
    left = np.array([-forward[1], forward[0], 0.0]) / np.hypot(forward[0], forward[1])
    return tip, heart, tip + 0.1 * left


def _width(model: mujoco.MjModel, foot: Foot) -> float:
    """Extent of the collision geoms of a foot across its sole, m."""
    tip, heart, left = np.array(_foot_points(foot))
    across = (left - tip) / np.linalg.norm(left - tip)
    ends = []
    for geom in np.flatnonzero(model.geom_bodyid == model.body(foot.body).id):
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            centre, half = np.split(model.geom_aabb[geom], 2)
            axis = rotations.rotate(rotations.conjugate(model.geom_quat[geom]), across)
            middle = across @ (model.geom_pos[geom] - heart) + axis @ centre
            ends += [middle - np.abs(axis) @ half, middle + np.abs(axis) @ half]
    return float(np.ptp(ends))


@lru_cache(maxsize=8)
def _compile(
    robot: Robot, scene: Scene, contact_distance: float, self_distance: float | None
) -> mujoco.MjModel:
    spec = distance_spec(robot, scene, contact_distance, self_distance or 0.0)
    if self_distance is None:
        for geom in spec.geoms:
            if geom.parent.name not in ("world", OBJECT):
                geom.conaffinity = 0  # robot geoms meet the surroundings, but no longer each other
    return spec.compile()
