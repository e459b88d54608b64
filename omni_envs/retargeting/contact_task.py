"""Touching where the human touches."""

from __future__ import annotations

import mujoco
import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting import kernels
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.tasks import CostTask, Quadratic

_NEAR = 0.01  # m
_RAMP = 5  # frames


class ContactTask(CostTask):
    """½ w Σ ‖gap‖² from where the human touches the surface to the nearest point of the link.

    A cost beside the interaction mesh, which keeps hands near an object but not on the same place
    of it.

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
        if source.object_poses is not None:
            poses = source.object_poses
            places = [poses[:, :3] + rotations.rotate(poses[:, 3:], place) for place in places]
        self._places = np.array(places).reshape(len(links), source.num_frames, 3)
        self._links = [_Link(configuration, link) for link in links]
        self._ramps = _ramps(np.isfinite(self._places).all(axis=2))
        self.set_frame(None)

    def set_frame(self, t: int | None) -> None:
        """Chooses the source frame; None switches the task off."""
        touching = [] if t is None else np.flatnonzero(self._ramps[:, t]).tolist()
        self._active = [(self._links[i], self._places[i, t]) for i in touching]
        self._ramp = np.repeat([self._ramps[i, t] for i in touching], 3)

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns the Gauss-Newton model; the nearest points are fixed to the links."""
        if not self._active:
            return None
        nearest = [link.nearest(configuration, place) for link, place in self._active]
        bodies = np.array([body for body, _, _ in nearest])
        gaps = np.array([gap for _, _, gap in nearest])
        jacobian = configuration.body_jacobians(
            bodies, np.array([point for _, point, _ in nearest])
        )
        J = np.moveaxis(jacobian, 0, 1).reshape(gaps.size, -1)
        return Quadratic(*kernels.weighted_squares(J, -gaps.ravel(), self._weight * self._ramp))


def _ramps(touching: np.ndarray) -> np.ndarray:
    """(links, T) weight in [0, 1] that rises and falls within each contact: no pull is sudden."""
    ramps = np.zeros(touching.shape)
    for ramp, flags in zip(ramps, touching, strict=True):
        edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
        for start, end in edges.reshape(-1, 2).tolist():
            since = np.arange(1, end - start + 1) + (_RAMP if start == 0 else 0)
            left = np.arange(end - start, 0, -1) + (_RAMP if end == len(flags) else 0)
            ramp[start:end] = np.minimum(np.minimum(since, left) / _RAMP, 1.0)
    return ramps


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
    ) -> tuple[int, np.ndarray, np.ndarray]:
        """Body and point of the link nearest to a place, and the gap from there, 0 inside."""
        data = configuration.data
        nearest, away, length = kernels.nearest_box(
            data.geom_xpos, data.geom_xmat, self._geoms, self._half, self._radius, place
        )
        # Within the dead zone the place counts as touched.
        reach = self._radius[nearest] + _NEAR
        gap = away * max(0.0, 1.0 - reach / max(length, 1e-12))
        return int(self._bodies[nearest]), place - gap, gap


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
