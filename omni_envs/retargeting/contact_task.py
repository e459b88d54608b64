"""Touching where the human touches."""

from __future__ import annotations

import mujoco
import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.contact_pull import nearest_box, pull, pulls
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.ramps import ramps
from omni_envs.retargeting.tasks import CostTask, Quadratic

_NEAR = 0.01  # m: a place this close counts as touched


class ContactTask(CostTask):
    """w Σ ρ(gap) from where the human touches the surface to the nearest point of the link.

    A cost beside the interaction mesh, which keeps hands near an object but not on the same place
    of it. ρ is that of ``contact_pull.pull``: a parabola, so that a strong pull closes small gaps;
    a steady force from 1 to 8 cm; and beyond that it gives up.

    Args:
        source: The motion, with its contact points.
        configuration: Kinematics of the robot.
        weight: w, 1/m².
    """

    def __init__(self, source: SourceMotion, configuration: Kinematics, weight: float) -> None:
        self._weight = weight
        links = [
            link for link in source.contact_points if link in configuration.robot.contact_links
        ]
        places = [np.asarray(source.contact_points[link], float) for link in links]
        touching = np.array([np.isfinite(place).all(axis=1) for place in places])
        touching = touching.reshape(len(links), source.num_frames)
        self._ramps, nearest = ramps(touching, source.fps)
        places = [place[near] for place, near in zip(places, nearest, strict=True)]
        if source.object_poses is not None:
            poses = source.object_poses
            places = [poses[:, :3] + rotations.rotate(poses[:, 3:], place) for place in places]
        self._places = np.array(places).reshape(len(links), source.num_frames, 3)
        self._links = [_Link(configuration, link) for link in links]
        self.set_frame(None)

    def set_frame(self, t: int | None) -> None:
        """Chooses the source frame; None switches the task off."""
        touching = [] if t is None else np.flatnonzero(self._ramps[:, t]).tolist()
        self._active = [(self._links[i], self._places[i, t]) for i in touching]
        self._pulls = np.array([self._weight * self._ramps[i, t] for i in touching])

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns a model of second order in the motion of the nearest points."""
        if not self._active:
            return None
        nearest = [link.nearest(configuration, place) for link, place in self._active]
        bodies, points, units, distances, lengths, beyond = map(
            np.array, zip(*nearest, strict=True)
        )
        jacobian = configuration.body_jacobians(bodies, points)
        return Quadratic(*pulls(jacobian, units, distances, lengths, beyond, self._pulls))

    def value(self, configuration: Kinematics) -> float:
        """Returns the cost alone, which needs no Jacobians."""
        distances = [link.nearest(configuration, place)[3] for link, place in self._active]
        return sum(
            weight * pull(distance)[0]
            for weight, distance in zip(self._pulls, distances, strict=True)
        )


class _Link:
    """The collision geoms of a link: boxes (h, r) with half extents h, grown by r."""

    def __init__(self, configuration: Kinematics, name: str) -> None:
        model = configuration.model
        bodies = [model.body(body).id for body in configuration.robot.contact_links[name]]
        self._geoms = np.flatnonzero(np.isin(model.geom_bodyid, bodies))
        shapes = [_core(model, int(geom)) for geom in self._geoms]
        self._half = np.array([half for half, _ in shapes])
        self._radius = np.array([radius for _, radius in shapes])
        self._bodies = model.geom_bodyid[self._geoms]

    def nearest(
        self, configuration: Kinematics, place: np.ndarray
    ) -> tuple[int, np.ndarray, np.ndarray, float, float, np.ndarray]:
        """Body, nearest point, and what ``contact_pull.pulls`` asks for, of the link and a place.

        Within the dead zone the place itself is the point.
        """
        data = configuration.data
        nearest, unit, length, beyond = nearest_box(
            data.geom_xpos, data.geom_xmat, self._geoms, self._half, self._radius, place
        )
        distance = length - self._radius[nearest] - _NEAR
        point = place - max(distance, 0.0) * unit
        return self._bodies[nearest], point, unit, distance, max(length, _NEAR), beyond


def _core(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, float]:
    """Half extents and radius of a geom; an inner box of what is not sphere, capsule or box."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == int(mujoco.mjtGeom.mjGEOM_SPHERE):
        return np.zeros(3), float(size[0])
    if kind == int(mujoco.mjtGeom.mjGEOM_CAPSULE):
        return np.array([0.0, 0.0, size[1]]), float(size[0])
    if kind == int(mujoco.mjtGeom.mjGEOM_BOX):
        return size.copy(), 0.0
    return model.geom_aabb[geom, 3:] / np.sqrt(3.0), 0.0
