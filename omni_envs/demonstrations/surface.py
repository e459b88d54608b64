"""Closest points on convex parts: exact, vectorised, without an acceleration structure."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from trimesh.triangles import closest_point as closest_on_triangles

from omni_envs.rotations import conjugate, rotate
from omni_envs.scenes import Box, ConvexMesh, Part

_CHUNK = 4096


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


def _on_mesh(mesh: ConvexMesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    triangles = mesh.vertices[mesh.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(normals, axis=1)
    triangles, normals = triangles[size > 1e-12], normals[size > 1e-12] / size[size > 1e-12, None]
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
