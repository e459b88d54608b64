"""Whether the robot touches what the human touched, and where."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from omni_envs import rotations
from omni_envs.metrics.playback import TARGETS, Playback
from omni_envs.robots import Robot
from omni_envs.scenes import GROUND, OBJECT, TERRAIN, Scene

# Distances from a point to the robot are measured up to here (m).
_FAR = 10.0


def contact_surfaces(scene: Scene, link: str) -> tuple[str, ...]:
    """Returns what a link's contact is with, as in ``demonstrations.contact``.

    The object where there is one; else the terrain, and for hands and knees the ground too. Feet on
    flat ground are left to the stance sets.
    """
    if scene.object is not None:
        return (OBJECT,)
    return (TERRAIN,) if link.endswith("foot") else (TERRAIN, GROUND)


def link_distance(playback: Playback, link: str, surfaces: tuple[str, ...]) -> np.ndarray:
    """Returns the (T,) signed distance of a link to the nearest surface, m, infinite beyond reach.

    Args:
        playback: The motion.
        link: Name of ``CONTACT_LINKS``.
        surfaces: Names of ``playback.TARGETS``.
    """
    near = np.isin(playback.target, [TARGETS.index(s) for s in surfaces])
    pairs = near & playback.bodies(playback.robot.contact_links[link])
    distance = np.full(playback.num_frames, np.inf)
    np.minimum.at(distance, playback.frame[pairs], playback.distance[pairs])
    return distance


def contact_gaps(
    playback: Playback,
    points: Mapping[str, np.ndarray],
    object_poses: np.ndarray | None,
) -> dict[str, np.ndarray]:
    """Distance from the point that the human touches to the nearest point of the robot's link.

    Args:
        playback: The motion.
        points: Link to (T, 3) points of the surface, in the object frame where ``object_poses`` are
            given, else in the world; NaN without contact.
        object_poses: (T, 7) or None.

    Returns:
        Link to (T,) m, 0 where the point is inside the link, NaN without a point.
    """
    probe = _Probe(playback.robot)
    gaps = {}
    for link, places in points.items():
        gap = np.full(playback.num_frames, np.nan)
        touching = np.flatnonzero(np.isfinite(places).all(axis=1))
        world = places[touching]
        if object_poses is not None and len(touching):
            poses = object_poses[touching]
            world = poses[:, :3] + rotations.rotate(poses[:, 3:], world)
        for t, point in zip(touching, world, strict=True):
            gap[t] = max(0.0, probe.distance(playback.qpos[t], point, link))
        gaps[link] = gap
    return gaps


class _Probe:
    """Distance from a point to the collision geoms of a link, whatever their shape."""

    def __init__(self, robot: Robot) -> None:
        spec = robot.spec()
        for geom in list(spec.geoms):
            if geom.group in (2, 5):  # looks, and what collides in physics only: see ``Robot.mjcf``
                spec.delete(geom)
        body = spec.worldbody.add_body(name="probe", mocap=True)
        body.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(1e-6, 0, 0))
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._probe = self._model.geom("probe").id
        bodies = self._model.geom_bodyid
        self._geoms = {
            link: np.flatnonzero(np.isin(bodies, [self._model.body(n).id for n in names])).tolist()
            for link, names in robot.contact_links.items()
        }

    def distance(self, qpos: np.ndarray, point: np.ndarray, link: str) -> float:
        self._data.qpos[:] = qpos
        self._data.mocap_pos[0] = point
        mujoco.mj_kinematics(self._model, self._data)
        return min(
            mujoco.mj_geomDistance(self._model, self._data, self._probe, geom, _FAR, None)
            for geom in self._geoms[link]
        )
