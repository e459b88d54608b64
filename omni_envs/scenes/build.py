"""One builder for kinematics and physics: robot + scene → ``MjSpec``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from omni_envs.robots import Robot
from omni_envs.scenes.heightfield import THICKNESS, HeightField
from omni_envs.scenes.scene import Scene
from omni_envs.scenes.shapes import Box, Part

GROUND = "ground"
OBJECT = "object"
TERRAIN = "terrain"

# Geom groups of a robot's MJCF (see ``Robot.mjcf``).
LOOKS, COLLISION, KINEMATICS_ONLY, PHYSICS_ONLY = 2, 3, 4, 5

# Collision bits. Robot geoms meet each other and the environment; environment geoms do not meet
# each other, but the object meets ground and terrain.
_ROBOT_BIT, _ENVIRONMENT_BIT = 1, 2

_FEW_PARTS = 16
"""Terrain of more parts is searched by a tree of bounding boxes."""

_GROUND_RGB, _GROUND_RGB2 = (0.86, 0.88, 0.90), (0.80, 0.82, 0.85)
_OBJECT_RGBA = (0.80, 0.58, 0.36, 1.0)
_TERRAIN_RGBA = (0.55, 0.62, 0.68, 1.0)


@dataclass(frozen=True)
class PhysicsOptions:
    """Physics settings of the simulated model.

    Attributes:
        timestep: Physics step, s.
        integrator: ``"implicitfast"``, ``"discrete"`` or ``"euler"``.
        iterations: Newton iterations at most; fewer than 5 is unstable.
        ls_iterations: Line-search iterations at most.
    """

    timestep: float = 0.005
    integrator: Literal["implicitfast", "discrete", "euler"] = "implicitfast"
    iterations: int = 10
    ls_iterations: int = 20


def shown_group(groups: Iterable[int]) -> int:
    """The geom group to look at a robot by: its looks, or what collides where it has none."""
    return LOOKS if LOOKS in groups else COLLISION


def build_spec(
    robot: Robot | None, scene: Scene, physics: PhysicsOptions | None = None, looks: bool = True
) -> mujoco.MjSpec:
    """Builds the model specification of a robot in a scene.

    Names: ground geom ``ground``, object body ``object`` with geoms ``object_0…``, terrain geoms
    ``terrain_0…`` and, for a height field, ``terrain``.

    Args:
        robot: The robot, or None for the scene alone.
        scene: Ground, object and terrain.
        physics: None builds for kinematics: the object is a mocap body, robot geoms of group 5 are
            removed. With options the object is a free body (joint ``object``), robot geoms of
            group 4 are removed.
        looks: Keep the visual-only geoms (group 2). Drop them where nothing is rendered.

    Returns:
        A fresh specification; compile it, or add sensors and cameras first.
    """
    spec = robot.spec() if robot is not None else mujoco.MjSpec()
    spec.modelname = f"{robot.name if robot else 'scene'}"
    drop = {KINEMATICS_ONLY if physics else PHYSICS_ONLY} | (set() if looks else {LOOKS})
    for geom in list(spec.geoms):
        if geom.group in drop:
            spec.delete(geom)
        elif geom.group == LOOKS:
            geom.contype = geom.conaffinity = 0
        else:
            geom.contype, geom.conaffinity = _ROBOT_BIT, _ROBOT_BIT
    _add_ground(spec, scene)
    if scene.terrain is not None:
        for i, part in enumerate(scene.terrain.parts):
            _add_part(spec, spec.worldbody, f"{TERRAIN}_{i}", part, _TERRAIN_RGBA, friction=1.0)
        if scene.terrain.heightfield is not None:
            _add_heightfield(spec, scene.terrain.heightfield)
    if scene.object is not None:
        body = spec.worldbody.add_body(name=OBJECT)
        if physics:
            body.add_freejoint(name=OBJECT)
        else:
            body.mocap = True
        surface = scene.object.surface()
        for i, part in enumerate(scene.object.parts):
            geom = _add_part(spec, body, f"{OBJECT}_{i}", part, _OBJECT_RGBA, scene.object.friction)
            geom.mass = scene.object.mass * part.mesh().volume / surface.volume
            if physics:
                geom.conaffinity |= _ENVIRONMENT_BIT
    option = spec.option
    if physics:
        option.timestep = physics.timestep
        option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{physics.integrator.upper()}")
        option.iterations, option.ls_iterations = physics.iterations, physics.ls_iterations
        # Same trajectory as the dense Jacobian to 1e-15, 1.28 times faster.
        option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
        # One robot and its object are one island; a few geoms per body are tested faster than a
        # tree of boxes around them. Neither changes what the contacts are.
        disabled = mujoco.mjtDisableBit.mjDSBL_ISLAND
        if len(scene.terrain.parts if scene.terrain is not None else ()) <= _FEW_PARTS:
            disabled |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
        option.disableflags = int(disabled)
    return spec


def _add_ground(spec: mujoco.MjSpec, scene: Scene) -> None:
    spec.add_texture(
        name=GROUND,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=_GROUND_RGB,
        rgb2=_GROUND_RGB2,
        width=256,
        height=256,
    )
    material = spec.add_material(name=GROUND, texrepeat=(1, 1), texuniform=True, reflectance=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = GROUND
    spec.worldbody.add_geom(
        name=GROUND,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0, 0, 1),
        material=GROUND,
        friction=(scene.ground_friction, 0.005, 0.0001),
        contype=_ENVIRONMENT_BIT,
        conaffinity=_ROBOT_BIT,
    )


def _add_heightfield(spec: mujoco.MjSpec, field: HeightField) -> None:
    low, high = float(field.heights.min()), float(field.heights.max())
    rows, columns = field.heights.shape
    # MuJoCo stretches the heights over [0, 1] and scales them by the third size.
    spec.add_hfield(
        name=TERRAIN,
        nrow=rows,
        ncol=columns,
        size=(0.5 * field.size[0], 0.5 * field.size[1], max(high - low, 1e-9), THICKNESS),
        userdata=field.heights.ravel(),
    )
    spec.worldbody.add_geom(
        name=TERRAIN,
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname=TERRAIN,
        pos=(*field.position, low),
        rgba=_TERRAIN_RGBA,
        friction=(1.0, 0.005, 0.0001),
        contype=_ENVIRONMENT_BIT,
        conaffinity=_ROBOT_BIT,
    )


def _add_part(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    name: str,
    part: Part,
    rgba: tuple[float, float, float, float],
    friction: float,
) -> mujoco.MjsGeom:
    geom = body.add_geom(
        name=name,
        pos=part.position,
        quat=part.quaternion,
        rgba=rgba,
        friction=(friction, 0.005, 0.0001),
        contype=_ENVIRONMENT_BIT,
        conaffinity=_ROBOT_BIT,
    )
    if isinstance(part.shape, Box):
        geom.type = mujoco.mjtGeom.mjGEOM_BOX
        geom.size = part.shape.half_extents
    else:
        mesh = spec.add_mesh(name=name)
        mesh.uservert = np.asarray(part.shape.vertices, float).ravel()
        mesh.userface = np.asarray(part.shape.faces, int).ravel()
        geom.type = mujoco.mjtGeom.mjGEOM_MESH
        geom.meshname = name
    return geom
