"""A robot motion played back in its scene: what all metrics look at."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from omni_envs import rotations
from omni_envs.errors import InvalidDataError
from omni_envs.robots import KEYPOINTS, SIDES, BodyPoint, Robot
from omni_envs.scenes import GROUND, OBJECT, TERRAIN, Scene, distance_spec

REACH = 0.1
"""Distances between robot and surroundings beyond this are not measured (m)."""

TARGETS = (OBJECT, TERRAIN, GROUND)
"""What a robot can touch beside itself."""
SELF = "self"

_MEMORY = 2**26  # for contacts; untouched memory costs nothing


@dataclass(frozen=True, eq=False)
class Playback:
    """Poses and close pairs of geoms of every frame, by forward kinematics and true geometry.

    The P pairs of all frames stand in flat arrays, a pair once for every contact point of it.

    Attributes:
        robot: The robot.
        fps: Frames per second.
        qpos: (T, 7 + n).
        body_names: B bodies of the robot.
        positions: (T, B, 3) of the bodies, m.
        quaternions: (T, B, 4) wxyz.
        frame: (P,) frame of a pair.
        target: (P,) what the robot is close to: index into ``TARGETS``, or -1 for itself.
        body: (P,) index into ``body_names`` of the robot's body (of the first one for itself).
        distance: (P,) signed distance, m, negative in penetration.
        normal: (P, 3) unit vector from the target to the robot.
    """

    robot: Robot
    fps: float
    qpos: np.ndarray
    body_names: tuple[str, ...]
    positions: np.ndarray
    quaternions: np.ndarray
    frame: np.ndarray
    target: np.ndarray
    body: np.ndarray
    distance: np.ndarray
    normal: np.ndarray

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.qpos)

    def points(self, points: list[BodyPoint]) -> np.ndarray:
        """Returns the (T, K, 3) world positions of K points of the robot."""
        index = [self.body_names.index(p.body) for p in points]
        offsets = np.array([p.offset for p in points])
        return self.positions[:, index] + rotations.rotate(self.quaternions[:, index], offsets)

    def keypoints(self) -> np.ndarray:
        """Returns the (T, 15, 3) keypoints in the order of ``KEYPOINTS``."""
        return self.points([self.robot.keypoints[k] for k in KEYPOINTS])

    def soles(self) -> np.ndarray:
        """Returns the (T, 2, K, 3) sole points, left foot first; the last fills a shorter sole."""
        feet = [self.robot.feet[side] for side in SIDES]
        most = max(len(foot.sole) for foot in feet)
        rows = [[*foot.sole, *[foot.sole[-1]] * (most - len(foot.sole))] for foot in feet]
        points = [BodyPoint(f.body, p) for f, row in zip(feet, rows, strict=True) for p in row]
        return self.points(points).reshape(self.num_frames, 2, most, 3)

    def bodies(self, names: tuple[str, ...]) -> np.ndarray:
        """Returns which of the P pairs belong to any of these bodies, (P,) bool."""
        return np.isin(self.body, [self.body_names.index(name) for name in names])


def play(
    robot: Robot, scene: Scene, fps: float, qpos: np.ndarray, object_poses: np.ndarray | None
) -> Playback:
    """Plays a motion back.

    Pairs that touch at rest (``robots.self_collision``) and neighbours in the body tree are left
    out.

    Args:
        robot: The robot.
        scene: Its surroundings.
        fps: Frames per second.
        qpos: (T, 7 + n) configurations.
        object_poses: (T, 7) poses where the scene has an object, else None.

    Raises:
        InvalidDataError: An array does not fit the robot or the scene, or is not finite.
    """
    qpos = _checked("qpos", qpos, robot.nq)
    if not (np.isfinite(fps) and fps > 0):
        raise InvalidDataError("Motion", "fps", "positive", str(fps))
    if (object_poses is None) != (scene.object is None):
        raise InvalidDataError(
            "Motion",
            "object_poses",
            "given exactly when the scene has an object",
            f"object {'absent' if scene.object is None else 'present'}",
        )
    if object_poses is not None:
        object_poses = _checked("object_poses", object_poses, 7)
        if len(object_poses) != len(qpos):
            raise InvalidDataError(
                "Motion", "object_poses", f"of {len(qpos)} frames", str(len(object_poses))
            )
    model = _compile(robot, scene)
    data = mujoco.MjData(model)
    target_of = np.array([_target(model, geom) for geom in range(model.ngeom)])
    ids = np.array([model.body(name).id for name in robot.body_names])
    index_of = np.full(model.nbody, -1)
    index_of[ids] = np.arange(len(ids))
    positions, quaternions = np.empty((len(qpos), len(ids), 3)), np.empty((len(qpos), len(ids), 4))
    counts, geoms, distances, normals = [], [], [], []
    for t in range(len(qpos)):
        data.qpos[:] = qpos[t]
        if object_poses is not None:
            data.mocap_pos[0], data.mocap_quat[0] = object_poses[t, :3], object_poses[t, 3:]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        positions[t], quaternions[t] = data.xpos[ids], data.xquat[ids]
        counts.append(data.ncon)
        geoms.append(data.contact.geom.reshape(-1, 2).copy())
        distances.append(data.contact.dist.copy())
        normals.append(data.contact.frame.reshape(-1, 9)[:, :3].copy())
    full = data.warning[int(mujoco.mjtWarning.mjWARN_CONTACTFULL)].number
    if full:  # contacts were dropped: any figure would be too good
        raise InvalidDataError(
            "Motion", "contacts", f"fewer than {_MEMORY} bytes hold", f"{full} overflows"
        )
    geom, normal = np.concatenate(geoms), np.concatenate(normals)
    # The robot's geom first, the target second; MuJoCo's normal points from the first to the
    # second.
    swap = target_of[geom[:, 0]] >= 0
    geom[swap] = geom[swap, ::-1]
    normal[~swap] *= -1.0
    return Playback(
        robot=robot,
        fps=float(fps),
        qpos=qpos,
        body_names=robot.body_names,
        positions=positions,
        quaternions=quaternions,
        frame=np.repeat(np.arange(len(qpos)), counts),
        target=target_of[geom[:, 1]],
        body=index_of[model.geom_bodyid[geom[:, 0]]],
        distance=np.concatenate(distances),
        normal=normal,
    )


def _compile(robot: Robot, scene: Scene) -> mujoco.MjModel:
    # Robot bodies find each other in penetration only.
    spec = distance_spec(robot, scene, contact_distance=REACH, self_distance=0.0)
    for geom in spec.geoms:
        geom.gap = 0.0
    spec.memory = _MEMORY
    return spec.compile()


def _target(model: mujoco.MjModel, geom: int) -> int:
    name = model.geom(geom).name
    if int(model.geom_bodyid[geom]) == 0:
        return TARGETS.index(GROUND if name == GROUND else TERRAIN)
    body = model.body(int(model.geom_bodyid[geom])).name
    return TARGETS.index(OBJECT) if body == OBJECT else -1


def _checked(name: str, array: np.ndarray, width: int) -> np.ndarray:
    array = np.array(array, float)
    if array.ndim != 2 or array.shape[1] != width or not len(array):
        raise InvalidDataError("Motion", name, f"(T, {width})", str(array.shape))
    if not np.isfinite(array).all():
        raise InvalidDataError("Motion", name, "finite", "NaN or infinity")
    return array
