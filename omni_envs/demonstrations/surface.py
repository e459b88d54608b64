"""Closest points on convex parts: exact, vectorised, without an acceleration structure."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from trimesh.triangles import closest_point as closest_on_triangles

from omni_envs.rotations import conjugate, rotate
from omni_envs.scenes import Box, ConvexMesh, Part

_CHUNK = 4096
_BURIED = 1e-3  # m: a point that lies deeper in another part is no surface


def closest_points(parts: Iterable[Part], points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Projects points onto the surface of a union of convex parts.

    Args:
        parts: Convex parts in one frame.
        points: (P, 3) points in that frame, m.

    Returns:
        (P, 3) closest surface points of the nearest part, and (P,) signed distances, m, negative
        inside. Without parts: NaN and infinity.
    """
    points = np.asarray(points, float)
    closest = np.full(points.shape, np.nan)
    distance = np.full(len(points), np.inf)
    for part in parts:
        orientation = np.asarray(part.quaternion)
        local = rotate(conjugate(orientation), points - part.position)
        shape = part.shape
        found, signed = _on_box(shape, local) if isinstance(shape, Box) else _on_mesh(shape, local)
        nearer = signed < distance
        closest[nearer] = rotate(orientation, found[nearer]) + part.position
        distance[nearer] = signed[nearer]
    return closest, distance


def exposed_points(
    parts: tuple[Part, ...], points: np.ndarray, ground: bool, eyes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Projects points onto what can be touched of convex parts that stand on the ground z = 0.

    As ``closest_points``, but a point inside leaves through a face that is not buried in another
    part or in the ground, and that its eye is before: a hand that the recording has inside a thin
    ramp touches the side of it that the elbow is on.

    Args:
        parts: Convex parts in the world, may be empty.
        points: (P, 3) points, m.
        ground: Whether the ground can be touched, too.
        eyes: (P, 3) where each point comes from, m.

    Returns:
        (P, 3) closest points and (P,) signed distances, m, negative inside.
    """
    points = np.asarray(points, float)
    closest, distance = closest_points(parts, points)
    inside = np.flatnonzero(distance < 0)
    if ground:
        above = points * (1.0, 1.0, 0.0)
        nearer = (points[:, 2] < distance) & (distance >= 0)
        closest[nearer], distance[nearer] = above[nearer], points[nearer, 2]
        inside = np.union1d(inside, np.flatnonzero(points[:, 2] < 0))
    size = max(1, _CHUNK // max(1, sum(_face_count(part) for part in parts)))
    for start in range(0, len(inside), size):
        rows = inside[start : start + size]
        ends, depth = _exits(parts, points[rows], ground, eyes[rows])
        best = np.argmin(depth, axis=1)
        each = np.arange(len(rows))
        found = np.isfinite(depth[each, best])
        closest[rows[found]] = ends[each, best][found]
        distance[rows[found]] = -depth[each, best][found]
    return closest, distance


def _exits(
    parts: tuple[Part, ...], points: np.ndarray, ground: bool, eyes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ways out of points inside: (P, E, 3) straight ahead through every face, and (P, E) depths.

    The depth is infinite where the way does not end on the surface, or in another part, or where
    the eye does not see that face.
    """
    through = [_through_faces(part, points, eyes) for part in parts]
    through.append((points[:, None] * (1.0, 1.0, 0.0), -points[:, None, 2]))
    ends = np.concatenate([at for at, _ in through], axis=1)
    depth = np.concatenate([deep for _, deep in through], axis=1)
    outside = closest_points(parts, ends.reshape(-1, 3))[1].reshape(depth.shape)
    free = (depth >= 0) & (outside >= -_BURIED) & (ends[..., 2] >= -_BURIED)
    free[:, :-1] &= outside[:, :-1] <= _BURIED
    free[:, -1] &= ground
    return ends, np.where(free, depth, np.inf)


def _face_count(part: Part) -> int:
    return 6 if isinstance(part.shape, Box) else len(part.shape.faces)


def _through_faces(
    part: Part, points: np.ndarray, eyes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(P, F, 3) feet of the perpendiculars on all faces, and (P, F) depths.

    The depth is negative infinity where a point is outside or its eye is behind the face.
    """
    orientation = np.asarray(part.quaternion)
    local, seen = (
        rotate(conjugate(orientation), at - np.asarray(part.position)) for at in (points, eyes)
    )
    shape = part.shape
    if isinstance(shape, Box):
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        offsets = np.tile(np.asarray(shape.half_extents, float), 2)
    else:
        triangles, normals = _triangles(shape)
        offsets = np.einsum("fi,fi->f", normals, triangles[:, 0])
    depth = offsets - local @ normals.T
    depth[(depth < 0).any(axis=1)] = -np.inf
    depth[seen @ normals.T < offsets] = -np.inf
    ends = local[:, None] + np.where(np.isfinite(depth), depth, 0.0)[..., None] * normals
    return rotate(orientation, ends) + part.position, depth


def _on_box(box: Box, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    half = np.asarray(box.half_extents)
    closest = np.clip(points, -half, half)
    distance = np.linalg.norm(points - closest, axis=1)
    # Inside: leave through the nearest face.
    gap = half - np.abs(points)
    rows = np.flatnonzero((gap > 0).all(axis=1))
    axis = np.argmin(gap[rows], axis=1)
    closest[rows, axis] = np.copysign(half[axis], points[rows, axis])
    distance[rows] = -gap[rows, axis]
    return closest, distance


def _triangles(mesh: ConvexMesh) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3, 3) faces that have an area, and their (F, 3) unit normals."""
    triangles = mesh.vertices[mesh.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(normals, axis=1)
    return triangles[size > 1e-12], normals[size > 1e-12] / size[size > 1e-12, None]


def _on_mesh(mesh: ConvexMesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    triangles, normals = _triangles(mesh)
    offsets = np.einsum("fi,fi->f", normals, triangles[:, 0])
    closest, distance = np.empty_like(points), np.empty(len(points))
    for start in range(0, len(points), _CHUNK):
        chunk = points[start : start + _CHUNK]
        heights = chunk @ normals.T - offsets
        top = np.argmax(heights, axis=1)
        above = heights[np.arange(len(chunk)), top]
        found = chunk - above[:, None] * normals[top]  # right inside; outside it is a first guess
        signed = above.copy()
        # Outside, the closest point lies on a face that the point can see.
        point, face = np.nonzero((heights > 0) & (above > 0)[:, None])
        if len(point):
            candidates = closest_on_triangles(triangles[face], chunk[point])
            gaps = np.linalg.norm(candidates - chunk[point], axis=1)
            order = np.lexsort((gaps, point))
            first = order[np.unique(point[order], return_index=True)[1]]
            found[point[first]], signed[point[first]] = candidates[first], gaps[first]
        closest[start : start + _CHUNK] = found
        distance[start : start + _CHUNK] = signed
    return closest, distance
