"""Convex shapes: what objects and terrain are made of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from omni_envs.errors import FileFormatError, InvalidDataError

IDENTITY = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Box:
    """A box, centred at the origin of its frame.

    Attributes:
        half_extents: Half side lengths, m.
    """

    half_extents: tuple[float, float, float]

    def __post_init__(self) -> None:
        if len(self.half_extents) != 3 or not all(0 < h < np.inf for h in self.half_extents):
            raise InvalidDataError(
                "Box", "half_extents", "three positive lengths (m)", repr(self.half_extents)
            )

    def mesh(self) -> trimesh.Trimesh:
        """Returns the surface as a triangle mesh."""
        return trimesh.creation.box(extents=2.0 * np.asarray(self.half_extents))

    def scaled(self, scale: np.ndarray) -> Box:
        """Returns the box scaled per axis by ``scale`` (3,)."""
        return Box(tuple(float(v) for v in np.asarray(self.half_extents) * scale))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class ConvexMesh:
    """A convex polyhedron.

    Attributes:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices, outward.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def mesh(self) -> trimesh.Trimesh:
        """Returns the surface as a triangle mesh."""
        return trimesh.Trimesh(self.vertices, self.faces, process=False)

    def scaled(self, scale: np.ndarray) -> ConvexMesh:
        """Returns the polyhedron scaled per axis by ``scale`` (3,)."""
        return ConvexMesh(self.vertices * scale, self.faces)


Shape = Box | ConvexMesh


@dataclass(frozen=True)
class Part:
    """A convex shape at a fixed pose in the frame of its owner.

    Attributes:
        shape: The shape.
        position: Origin of the shape, m.
        quaternion: Orientation, wxyz.
    """

    shape: Shape
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = IDENTITY

    def mesh(self) -> trimesh.Trimesh:
        """Returns the surface in the frame of the owner."""
        transform = trimesh.transformations.quaternion_matrix(self.quaternion)
        transform[:3, 3] = self.position
        return self.shape.mesh().apply_transform(transform)


def load_convex_parts(path: str | Path, max_volume_error: float = 0.05) -> tuple[Part, ...]:
    """Loads a mesh file whose connected pieces are each convex.

    Every connected piece becomes one convex part. A piece is taken as convex when its hull is at
    most ``max_volume_error`` larger than itself.

    Args:
        path: OBJ, STL, PLY or any other format that trimesh reads.
        max_volume_error: Largest accepted relative volume difference between a piece and its hull.

    Raises:
        FileFormatError: The file is missing, unreadable, open, without volume or not convex.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing mesh file", "nothing")
    try:
        mesh = trimesh.load(path, force="mesh", process=True)
    except Exception as error:  # trimesh raises whatever its parsers raise
        raise FileFormatError(path, "mesh", "a mesh that trimesh reads", str(error)) from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) < 4:
        raise FileFormatError(path, "mesh", "a closed surface of at least 4 triangles", "fewer")
    if not np.isfinite(mesh.vertices).all():
        raise FileFormatError(path, "vertices", "finite coordinates", "NaN or infinity")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    parts = []
    for i, piece in enumerate(mesh.split(only_watertight=False)):
        hull = piece.convex_hull if len(piece.vertices) >= 4 else piece
        if not piece.is_watertight:
            raise FileFormatError(
                path, f"piece {i}", "a closed (watertight) surface", "an open one"
            )
        if abs(piece.volume) < 1e-9:
            raise FileFormatError(path, f"piece {i}", "a positive volume", f"{piece.volume:.3g} m³")
        if hull.volume > (1.0 + max_volume_error) * abs(piece.volume):
            raise FileFormatError(
                path,
                f"piece {i}",
                f"a convex piece (its hull at most {max_volume_error:.0%} larger than itself)",
                f"a hull {hull.volume / abs(piece.volume) - 1:.0%} larger",
            )
        parts.append(Part(ConvexMesh(np.array(hull.vertices), np.array(hull.faces))))
    return tuple(parts)
