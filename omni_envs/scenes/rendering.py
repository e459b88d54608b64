"""Offscreen pictures of a robot in a scene, with translucent ghosts of its reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from omni_envs.errors import RenderingError
from omni_envs.robots import Robot
from omni_envs.scenes.build import COLLISION, LOOKS, OBJECT, PHYSICS_ONLY, build_spec, shown_group
from omni_envs.scenes.scene import Scene

_GHOST_RGBA = (0.25, 0.62, 0.95, 0.35)
# In heights of the robot: how far away it fits into a square picture, and its middle.
_DISTANCE, _MIDDLE = 1.75, 0.44
_STANDING = 1.05
"""A root above so many heights of the standing one has climbed."""
_SKY_RGB = (0.93, 0.95, 0.97)


@dataclass(frozen=True)
class Camera:
    """A free camera that looks at a point.

    Attributes:
        azimuth: Degrees about z; 90 looks along +y.
        elevation: Degrees; negative looks down.
        distance: m from the point; None fits the robot into the picture.
        look_at: The point, m; None follows the robot's root, at ``height`` while the robot is on
            the ground, higher as it climbs.
        height: Height of the followed point, m; None is the middle of the standing robot.
    """

    azimuth: float = 125.0
    elevation: float = -11.0
    distance: float | None = None
    look_at: tuple[float, float, float] | None = None
    height: float | None = None


def camera_pose(camera: Camera, robot: Robot, qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns where a camera is and the point that it looks at, (3,) m each.

    Args:
        camera: The camera.
        robot: The robot that it shows.
        qpos: (nq,) pose of the robot.
    """
    point = camera.look_at
    if point is None:
        height = _MIDDLE * robot.height if camera.height is None else camera.height
        climbed = max(0.0, float(qpos[2]) - _STANDING * robot.default_root_height)
        point = (float(qpos[0]), float(qpos[1]), height + climbed)
    azimuth, elevation = np.deg2rad((camera.azimuth, camera.elevation))
    ahead = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    distance = _DISTANCE * robot.height if camera.distance is None else camera.distance
    return np.array(point) - distance * ahead, np.array(point)


class SceneRenderer:
    """Renders poses of a robot and its object; ghosts show other poses of the same.

    The rendered model is separate from any simulated one: only poses go in.

    Args:
        robot: The robot.
        scene: Its scene.
        ghosts: How many ghosts can be shown at once.
        width: Pixels.
        height: Pixels.

    Raises:
        RenderingError: There is no graphics context to be had.
    """

    def __init__(
        self, robot: Robot, scene: Scene, *, ghosts: int = 1, width: int = 640, height: int = 480
    ) -> None:
        self.width, self.height = width, height
        self._robot, self._nq = robot, robot.nq
        self._has_object = scene.object is not None
        self._model = _visual_model(build_spec(robot, scene), width, height)
        self._data = mujoco.MjData(self._model)
        ghost_spec = build_spec(robot, Scene(object=scene.object))
        ghost_spec.delete(ghost_spec.geom("ground"))
        self._ghost_model = _visual_model(ghost_spec, width, height)
        self._ghost_model.geom_matid[:] = -1
        self._ghost_model.geom_rgba[:] = _GHOST_RGBA
        # A ghost that coincides with the robot hides inside it instead of flickering through.
        self._ghost_model.geom_size[:] *= 0.98
        self._ghosts = [mujoco.MjData(self._ghost_model) for _ in range(ghosts)]
        try:
            self._renderer = mujoco.Renderer(self._model, height, width, max_geom=4000)
        except Exception as error:  # every GL backend has its own exception classes
            raise RenderingError(f"{type(error).__name__}: {error}.") from error
        self._option = mujoco.MjvOption()
        mujoco.mjv_defaultOption(self._option)
        self._option.geomgroup[:] = 0
        self._option.geomgroup[[0, LOOKS, COLLISION]] = 1

    def render(
        self,
        qpos: np.ndarray,
        object_pose: np.ndarray | None = None,
        *,
        ghost_qpos: Sequence[np.ndarray] | np.ndarray | None = None,
        ghost_object_pose: Sequence[np.ndarray] | np.ndarray | None = None,
        camera: Camera | None = None,
        points: np.ndarray | None = None,
    ) -> np.ndarray:
        """Renders one picture.

        Args:
            qpos: (nq,) robot pose.
            object_pose: (7,) object position and quaternion wxyz.
            ghost_qpos: (nq,) or (G, nq) ghost poses.
            ghost_object_pose: (7,) or (G, 7) ghost object poses; without, ghosts carry none.
            camera: Where to look from; the default follows the robot.
            points: (P, 3) points shown as small red spheres, e.g. human keypoints.

        Returns:
            (height, width, 3) uint8 picture.
        """
        _pose(self._model, self._data, qpos[: self._nq], object_pose if self._has_object else None)
        camera = camera or Camera()
        view = mujoco.MjvCamera()
        view.azimuth, view.elevation = camera.azimuth, camera.elevation
        eye, view.lookat = camera_pose(camera, self._robot, qpos)
        view.distance = float(np.linalg.norm(eye - view.lookat))
        self._renderer.update_scene(self._data, view, self._option)
        scene = self._renderer.scene
        if ghost_qpos is not None:
            poses = np.atleast_2d(ghost_qpos)
            objects = None if ghost_object_pose is None else np.atleast_2d(ghost_object_pose)
            for i, (data, pose) in enumerate(zip(self._ghosts, poses, strict=False)):
                shown = objects[i] if objects is not None and self._has_object else None
                _pose(self._ghost_model, data, pose[: self._nq], shown)
                mujoco.mjv_addGeoms(
                    self._ghost_model,
                    data,
                    self._option,
                    mujoco.MjvPerturb(),
                    mujoco.mjtCatBit.mjCAT_DYNAMIC,
                    scene,
                )
        for point in () if points is None else points:
            geom = scene.geoms[scene.ngeom]
            mujoco.mjv_initGeom(
                geom,
                mujoco.mjtGeom.mjGEOM_SPHERE,
                np.full(3, 0.018),
                np.asarray(point, float),
                np.eye(3).ravel(),
                np.array([0.9, 0.2, 0.15, 1.0], np.float32),
            )
            scene.ngeom += 1
        return self._renderer.render()

    def close(self) -> None:
        """Frees the graphics context."""
        self._renderer.close()


def _visual_model(spec: mujoco.MjSpec, width: int, height: int) -> mujoco.MjModel:
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.quality.shadowsize = 4096
    spec.visual.headlight.ambient = (0.35, 0.35, 0.35)
    spec.visual.headlight.diffuse = (0.45, 0.45, 0.45)
    spec.visual.headlight.specular = (0.1, 0.1, 0.1)
    spec.visual.map.fogstart, spec.visual.map.fogend = 8.0, 25.0
    spec.visual.rgba.fog = (*_SKY_RGB, 1.0)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=_SKY_RGB,
        rgb2=(0.75, 0.82, 0.90),
        width=64,
        height=64,
    )
    spec.worldbody.add_light(
        pos=(1.5, -2.0, 5.0),
        dir=(-0.25, 0.35, -1.0),
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        castshadow=True,
        diffuse=(0.55, 0.55, 0.55),
    )
    # Robot geoms that only collide are not looked at, unless there is nothing else; what a scene
    # shows is in group 0.
    shown = shown_group(geom.group for geom in spec.geoms)
    for geom in list(spec.geoms):
        if LOOKS <= geom.group <= PHYSICS_ONLY and geom.group != shown:
            spec.delete(geom)
    # Bodies may have had their mass from what was deleted; pictures need none.
    spec.compiler.boundmass, spec.compiler.boundinertia = 1e-3, 1e-6
    return spec.compile()


def _pose(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray, object_pose: np.ndarray | None
) -> None:
    data.qpos[: len(qpos)] = qpos
    if model.nmocap:
        mocap = int(model.body(OBJECT).mocapid[0])
        # An absent object is parked below the ground.
        pose = (0, 0, -50, 1, 0, 0, 0) if object_pose is None else object_pose
        data.mocap_pos[mocap], data.mocap_quat[mocap] = pose[:3], pose[3:7]
    mujoco.mj_forward(model, data)
