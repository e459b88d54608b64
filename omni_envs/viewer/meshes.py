"""Looks of a robot as triangles, for viewers that know no MuJoCo."""

from __future__ import annotations

from collections import defaultdict

import mujoco
import numpy as np
import trimesh

from omni_envs.robots import Robot
from omni_envs.scenes.build import shown_group

Colour = tuple[float, float, float, float]
_ROUND = 20  # corners of a circle


def robot_meshes(robot: Robot) -> dict[str, list[tuple[Colour, trimesh.Trimesh]]]:
    """Returns, for each body, one mesh in the body's frame for each colour (RGBA, 0 to 1)."""
    model = robot.model
    found: dict[tuple[str, Colour], list[trimesh.Trimesh]] = defaultdict(list)
    for geom in np.flatnonzero(model.geom_group == shown_group(model.geom_group)):
        material = int(model.geom_matid[geom])
        rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
        colour: Colour = tuple(float(c) for c in rgba)  # type: ignore[assignment]
        body = robot.body_names[int(model.geom_bodyid[geom]) - 1]
        found[body, colour].append(geom_mesh(model, int(geom)))
    meshes: dict[str, list[tuple[Colour, trimesh.Trimesh]]] = defaultdict(list)
    for (body, colour), parts in found.items():
        meshes[body].append((colour, trimesh.util.concatenate(parts)))
    return dict(meshes)


def geom_mesh(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """Returns a geom as triangles in the frame of its body.

    Raises:
        ValueError: The geom has no bounded surface of its own (plane, height field).
    """
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=size[0])
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        mesh = trimesh.creation.icosphere(subdivisions=2)
        mesh.apply_scale(size)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        mesh = trimesh.creation.capsule(2 * size[1], size[0], count=(_ROUND, _ROUND // 2))
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        mesh = trimesh.creation.cylinder(size[0], 2 * size[1], sections=_ROUND)
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        mesh = trimesh.creation.box(2 * size)
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        data = int(model.geom_dataid[geom])
        start, count = int(model.mesh_vertadr[data]), int(model.mesh_vertnum[data])
        first, faces = int(model.mesh_faceadr[data]), int(model.mesh_facenum[data])
        mesh = trimesh.Trimesh(
            model.mesh_vert[start : start + count],
            model.mesh_face[first : first + faces],
            process=False,
        )
    else:
        raise ValueError(f"no mesh for a geom of type {kind.name}")
    placement = trimesh.transformations.quaternion_matrix(model.geom_quat[geom])
    placement[:3, 3] = model.geom_pos[geom]
    mesh.apply_transform(placement)
    return mesh
