"""What stands around the robot: ground, one moving object, static terrain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh

from omni_envs.errors import InvalidDataError
from omni_envs.scenes.heightfield import HeightField
from omni_envs.scenes.shapes import Box, ConvexMesh, Part


def _surface(parts: tuple[Part, ...]) -> trimesh.Trimesh:
    return trimesh.util.concatenate([p.mesh() for p in parts])


def _scaled(parts: tuple[Part, ...], scale: float | np.ndarray) -> tuple[Part, ...]:
    scale = np.broadcast_to(np.asarray(scale, float), 3)
    if not np.allclose(scale, scale[0]):
        # A rotated part shears under a per-axis scale: scale its vertices in the owner's frame.
        parts = tuple(
            p
            if p.quaternion == (1.0, 0.0, 0.0, 0.0)
            else Part(ConvexMesh(np.array(p.mesh().vertices), np.array(p.mesh().faces)))
            for p in parts
        )
    return tuple(
        Part(p.shape.scaled(scale), tuple(np.asarray(p.position) * scale), p.quaternion)
        for p in parts
    )


@dataclass(frozen=True)
class SceneObject:
    """A rigid object made of convex parts, in its own frame.

    Attributes:
        name: Name for people.
        parts: Convex parts in the object frame.
        mass: kg.
        friction: Sliding friction coefficient.
    """

    name: str
    parts: tuple[Part, ...]
    mass: float = 1.0
    friction: float = 0.8

    def __post_init__(self) -> None:
        if not self.parts:
            raise InvalidDataError(
                f"Object {self.name!r}", "parts", "at least one convex part", "none"
            )
        if not 0 < self.mass < np.inf:
            raise InvalidDataError(
                f"Object {self.name!r}", "mass", "positive (kg)", repr(self.mass)
            )

    def surface(self) -> trimesh.Trimesh:
        """Returns the surface in the object frame."""
        return _surface(self.parts)

    def scaled(self, scale: float | np.ndarray) -> SceneObject:
        """Returns the object scaled per axis, mass unchanged."""
        return replace(self, parts=_scaled(self.parts, scale))


@dataclass(frozen=True)
class Terrain:
    """Static convex parts and uneven ground in the world frame.

    Attributes:
        parts: Convex parts.
        heightfield: Uneven ground, if any.
    """

    parts: tuple[Part, ...] = ()
    heightfield: HeightField | None = None

    def __post_init__(self) -> None:
        if not self.parts and self.heightfield is None:
            raise InvalidDataError("Terrain", "parts", "at least one, or a height field", "none")

    def surface(self) -> trimesh.Trimesh:
        """Returns the surface in the world frame."""
        uneven = [] if self.heightfield is None else [self.heightfield.mesh()]
        return trimesh.util.concatenate([*(p.mesh() for p in self.parts), *uneven])

    def scaled(self, scale: float | np.ndarray) -> Terrain:
        """Returns the terrain scaled per axis about the world origin."""
        scale = np.broadcast_to(np.asarray(scale, float), 3)
        uneven = None if self.heightfield is None else self.heightfield.scaled(scale)
        return Terrain(_scaled(self.parts, scale), uneven)


@dataclass(frozen=True)
class Scene:
    """Flat ground at z = 0, at most one moving object, at most one terrain.

    Attributes:
        object: The object that moves, if any.
        terrain: What stands on the ground, if anything.
        ground_friction: Sliding friction of the ground.
    """

    object: SceneObject | None = None
    terrain: Terrain | None = None
    ground_friction: float = 1.0

    def to_dict(self) -> dict[str, Any]:
        """Returns the scene as JSON-compatible data; ``from_dict`` is its inverse."""

        def parts(ps: tuple[Part, ...]) -> list[dict[str, Any]]:
            rows = []
            for p in ps:
                row: dict[str, Any] = {"position": list(map(float, p.position))}
                row["quaternion"] = list(map(float, p.quaternion))
                if isinstance(p.shape, Box):
                    row["box"] = list(map(float, p.shape.half_extents))
                else:
                    row["vertices"] = np.asarray(p.shape.vertices, float).tolist()
                    row["faces"] = np.asarray(p.shape.faces, int).tolist()
                rows.append(row)
            return rows

        data: dict[str, Any] = {"ground_friction": float(self.ground_friction)}
        if self.object is not None:
            data["object"] = {
                "name": self.object.name,
                "mass": float(self.object.mass),
                "friction": float(self.object.friction),
                "parts": parts(self.object.parts),
            }
        if self.terrain is not None:
            data["terrain"] = {"parts": parts(self.terrain.parts)}
            if (field := self.terrain.heightfield) is not None:
                data["terrain"]["heightfield"] = {
                    "heights": field.heights.tolist(),
                    "size": list(map(float, field.size)),
                    "position": list(map(float, field.position)),
                }
        return data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Scene:
        """Rebuilds a scene from ``to_dict``.

        Raises:
            InvalidDataError: A field is missing or malformed.
        """

        def parts(rows: list[Mapping[str, Any]]) -> tuple[Part, ...]:
            return tuple(
                Part(
                    Box(tuple(r["box"]))
                    if "box" in r
                    else ConvexMesh(np.asarray(r["vertices"], float), np.asarray(r["faces"], int)),
                    tuple(r["position"]),
                    tuple(r["quaternion"]),
                )
                for r in rows
            )

        def heightfield(row: Mapping[str, Any] | None) -> HeightField | None:
            if row is None:
                return None
            heights = np.asarray(row["heights"], float)
            return HeightField(heights, tuple(row["size"]), tuple(row["position"]))

        try:
            obj, terrain = data.get("object"), data.get("terrain")
            return cls(
                object=None
                if obj is None
                else SceneObject(obj["name"], parts(obj["parts"]), obj["mass"], obj["friction"]),
                terrain=None
                if terrain is None
                else Terrain(parts(terrain["parts"]), heightfield(terrain.get("heightfield"))),
                ground_friction=data["ground_friction"],
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InvalidDataError(
                "Scene", "data", "what Scene.to_dict writes", repr(error)
            ) from error
