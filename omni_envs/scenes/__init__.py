"""What stands around the robot, and the one builder that turns it into a MuJoCo model."""

from omni_envs.scenes.build import GROUND, OBJECT, TERRAIN, PhysicsOptions, build_spec
from omni_envs.scenes.distances import distance_spec
from omni_envs.scenes.heightfield import HeightField
from omni_envs.scenes.scene import Scene, SceneObject, Terrain
from omni_envs.scenes.shapes import Box, ConvexMesh, Part, Shape, load_convex_parts
from omni_envs.scenes.terrains import (
    mesh_terrain,
    platform,
    slope_onto_block,
    stacked_platforms,
    uneven_ground,
)

__all__ = [
    "GROUND",
    "OBJECT",
    "TERRAIN",
    "Box",
    "ConvexMesh",
    "HeightField",
    "Part",
    "PhysicsOptions",
    "Scene",
    "SceneObject",
    "Shape",
    "Terrain",
    "build_spec",
    "distance_spec",
    "load_convex_parts",
    "mesh_terrain",
    "platform",
    "slope_onto_block",
    "stacked_platforms",
    "uneven_ground",
]
