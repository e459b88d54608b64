"""Convex shapes: what objects and terrain are made of."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

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


def load_convex_parts(path: str | Path, max_depth: float = 0.1) -> tuple[Part, ...]:
    """Loads a mesh file whose connected pieces are each convex.

    Every connected piece becomes one convex part: a ``Box`` when its hull is within 1 mm of its
    oriented bounding box, else its hull, thinned to within 0.2 mm or 256 vertices. Scans are
    welcome: a piece may be dented, as long as its surface stays close to its hull, and scan debris
    (pieces below 5 % of the whole) joins the nearest true piece.

    Args:
        path: OBJ, STL, PLY or any other format that trimesh reads.
        max_depth: Deepest accepted dent below the hull, as a fraction of the piece's smallest
            extent.

    Raises:
        FileFormatError: The file is missing, unreadable, open, flat or not convex.
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
    for i, (closed, surface, points) in enumerate(_pieces(mesh)):
        if not closed:
            raise FileFormatError(path, f"piece {i}", "a closed surface", "an open one")
        try:
            hull = trimesh.Trimesh(points).convex_hull
        except Exception as error:  # qhull on flat input
            raise FileFormatError(path, f"piece {i}", "a positive volume", "a flat one") from error
        if hull.volume < 1e-9 or np.min(hull.extents) < 1e-6:
            raise FileFormatError(path, f"piece {i}", "a positive volume", f"{hull.volume:.3g} m³")
        part = _convex_part(hull)
        smallest = float(np.min(trimesh.bounds.oriented_bounds(part.mesh())[1]))
        depth = _depth_below(part.mesh(), np.vstack([surface, points]))
        if depth > max_depth * smallest:
            raise FileFormatError(
                path,
                f"piece {i}",
                f"a convex piece (dents at most {max_depth:.0%} of its smallest extent)",
                f"a surface {depth:.3f} m below its hull, {depth / smallest:.0%}",
            )
        parts.append(part)
    return tuple(parts)


def _pieces(mesh: trimesh.Trimesh) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """Splits into (closed, surface samples, vertices) per piece; debris joins the nearest one."""
    extent = np.linalg.norm(mesh.extents)
    # Scans have edges with four faces; only an edge with a single face is a hole.
    _, edge, uses = np.unique(mesh.edges_sorted, axis=0, return_inverse=True, return_counts=True)
    hole = (uses[edge.reshape(-1)] == 1).reshape(-1, 3).any(axis=1)
    labels = trimesh.graph.connected_component_labels(mesh.face_adjacency, len(mesh.faces))
    small, large, closed = [], [], []
    for label in range(labels.max() + 1):
        faces = np.flatnonzero(labels == label)
        triangles = mesh.triangles[faces]
        size = np.linalg.norm(np.ptp(triangles.reshape(-1, 3), axis=0))
        if size < 0.05 * extent:
            small.append(triangles)
            continue
        large.append(triangles)
        closed.append(not hole[faces].any())
    vertices = [[t.reshape(-1, 3)] for t in large]
    low = np.array([v[0].min(0) for v in vertices])
    high = np.array([v[0].max(0) for v in vertices])
    for debris in small:
        centre = debris.mean(axis=(0, 1))
        gaps = np.linalg.norm(np.clip(centre, low, high) - centre, axis=1)
        vertices[np.argmin(gaps)].append(debris.reshape(-1, 3))
    # Edge midpoints and face centres show a notch that lies between vertices on the hull.
    samples = [
        np.vstack([t.mean(axis=1), 0.5 * (t + np.roll(t, 1, axis=1)).reshape(-1, 3)]) for t in large
    ]
    points = [np.unique(np.vstack(v), axis=0) for v in vertices]
    return list(zip(closed, samples, points, strict=True))


def _depth_below(hull: trimesh.Trimesh, points: np.ndarray) -> float:
    """Largest distance of (P, 3) points inside a hull to its surface, m."""
    depth = np.full(len(points), np.inf)
    for *normal, offset in ConvexHull(hull.vertices).equations:  # inside: normal · x + offset ≤ 0
        np.minimum(depth, -offset - points @ np.array(normal), out=depth)
    return float(depth.max())


def _convex_part(hull: trimesh.Trimesh, box_error: float = 1e-3) -> Part:
    """A box where the hull is one to ``box_error`` (m), else the thinned hull."""
    hull = _thinned(hull)
    planes = ConvexHull(hull.vertices).equations
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    to_box, size = trimesh.bounds.oriented_bounds(hull)
    centred = np.mean(hull.bounds, axis=0), np.eye(3), hull.extents
    for centre, rotation, extents in (  # axis-aligned first: it needs no rotation
        centred,
        (np.linalg.inv(to_box)[:3, 3], *_least_rotation(to_box[:3, :3].T, size)),
    ):
        corners = centre + (0.5 * signs * extents) @ rotation.T
        if np.max(corners @ planes[:, :3].T + planes[:, 3]) <= box_error:
            quaternion = trimesh.transformations.quaternion_from_matrix(rotation)
            return Part(
                Box(tuple(float(e) / 2 for e in extents)),  # type: ignore[arg-type]
                tuple(map(float, centre)),  # type: ignore[arg-type]
                tuple(map(float, quaternion)),  # type: ignore[arg-type]
            )
    return Part(ConvexMesh(np.array(hull.vertices), np.array(hull.faces)))


def _thinned(
    hull: trimesh.Trimesh, error: float = 2e-4, max_vertices: int = 256
) -> trimesh.Trimesh:
    """Drops vertices while the hull stays within ``error`` (m), and beyond ``max_vertices``."""
    vertices = np.array(hull.vertices)
    if len(vertices) <= 32:
        return hull
    # Start with the extremes in 42 directions, then add the farthest vertex outside each face.
    directions = trimesh.creation.icosphere(subdivisions=1).vertices
    thin = ConvexHull(
        vertices[np.unique(np.argmax(vertices @ directions.T, axis=0))], incremental=True
    )
    while len(thin.vertices) < max_vertices:
        heights = vertices @ thin.equations[:, :3].T + thin.equations[:, 3]
        face, height = np.argmax(heights, axis=1), np.max(heights, axis=1)
        outside = height > error
        if not outside.any():
            break
        order = np.flatnonzero(outside)[np.argsort(-height[outside])]
        _, first = np.unique(face[order], return_index=True)
        farthest = order[np.sort(first)][: min(8, max_vertices - len(thin.vertices))]
        thin.add_points(vertices[farthest])
        # The hull only grows: what is inside now stays inside.
        outside[farthest] = False
        vertices = vertices[outside]
    return trimesh.Trimesh(thin.points[thin.vertices]).convex_hull


def _least_rotation(rotation: np.ndarray, extents: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Renames the axes of a box so that its frame (3, 3) is turned as little as possible."""
    best = max(
        (
            rotation[:, order] * np.array(sign)
            for order in map(list, permutations(range(3)))
            for sign in product((-1, 1), repeat=3)
        ),
        key=lambda r: np.trace(r) if np.linalg.det(r) > 0 else -np.inf,
    )
    return best, extents[np.argmax(np.abs(rotation.T @ best), axis=0)]
