"""Touching where the human touches."""

from __future__ import annotations

import mujoco
import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting import kernels
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.ramps import ramps
from omni_envs.retargeting.tasks import CostTask, Quadratic

_NEAR = 0.01  # m
# Gaps (m) at which the pull is full, and from which on it fades: what a robot cannot reach is no
# reason to contort it.
_FULL, _FADES = 0.01, 0.08


class ContactTask(CostTask):
    """w Σ ρ(‖gap‖) from where the human touches the surface to the nearest point of the link.

    A cost beside the interaction mesh, which keeps hands near an object but not on the same place
    of it. ρ(d) = ½ d² up to a = 1 cm, so that a strong pull closes small gaps; its force a stays up
    to b = 8 cm and falls with a (b/d)² beyond.

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
        self._ramp = np.array([self._ramps[i, t] for i in touching])

    def quadratic(self, configuration: Kinematics) -> Quadratic | None:
        """Returns a model of second order in the motion of the nearest points.

        ½‖gap‖² of a gap s u of length s has the curvature uuᵀ + (s/ℓ)(C - uuᵀ), with ℓ the length
        up to the core of the link and C the directions along which the nearest point does not
        slide. That times ρ'(s)/s is the curvature of a model which lies above w ρ.
        """
        if not self._active:
            return None
        nearest = self._nearest(configuration)
        bodies = np.array([body for body, *_ in nearest])
        gaps = np.array([gap for *_, gap, _ in nearest])
        roots = np.array([root for *_, root in nearest])
        jacobian = configuration.body_jacobians(
            bodies, np.array([point for _, point, *_ in nearest])
        )
        J = (roots @ np.moveaxis(jacobian, 0, 1)).reshape(gaps.size, -1)
        share, losses = pull(np.linalg.norm(gaps, axis=1))
        weights = self._weight * np.repeat(self._ramp * share, 3)
        H, g, _ = kernels.weighted_squares(J, -gaps.ravel(), weights)
        return Quadratic(H, g, self._weight * float(self._ramp @ losses))

    def value(self, configuration: Kinematics) -> float:
        """Returns the cost alone, which needs no Jacobians."""
        if not self._active:
            return 0.0
        gaps = np.array([gap for *_, gap, _ in self._nearest(configuration)])
        return self._weight * float(self._ramp @ pull(np.linalg.norm(gaps, axis=1))[1])

    def _nearest(
        self, configuration: Kinematics
    ) -> list[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
        """``_Link.nearest`` of every link that touches."""
        return [link.nearest(configuration, place) for link, place in self._active]


def pull(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ρ'(d)/d and ρ(d) of (K,) distances d, m: see ``ContactTask``."""
    d = np.maximum(distance, 1e-12)
    share = np.minimum(1.0, _FULL / d) * np.minimum(1.0, _FADES / d) ** 2
    steady = _FULL * (np.minimum(d, _FADES) - 0.5 * _FULL)
    fading = _FULL * np.maximum(_FADES - _FADES**2 / d, 0.0)
    return share, np.where(d <= _FULL, 0.5 * d * d, steady + fading)


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
    ) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
        """Body and point of the link nearest to a place, gap from there, 0 inside, and a root R.

        RᵀR is the curvature of ½‖gap‖², and R gap = gap.
        """
        data = configuration.data
        nearest, away, length, beyond = kernels.nearest_box(
            data.geom_xpos, data.geom_xmat, self._geoms, self._half, self._radius, place
        )
        # Within the dead zone the place counts as touched.
        reach = self._radius[nearest] + _NEAR
        part = max(0.0, 1.0 - reach / max(length, 1e-12))
        gap, along = away * part, np.outer(away, away) / max(length, 1e-12) ** 2
        root = along + np.sqrt(part) * (beyond - along)
        return int(self._bodies[nearest]), place - gap, gap, root


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
