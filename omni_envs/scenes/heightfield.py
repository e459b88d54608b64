"""Uneven ground as a grid of heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from trimesh.triangles import closest_point as closest_on_triangles

from omni_envs.errors import InvalidDataError

THICKNESS = 0.1
"""How far a height field reaches below its lowest point, m."""

_NEIGHBOURS = 2
# Distances are exact up to this many cells from the surface; farther ones are along z.


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights on a regular grid, joined by triangles as MuJoCo does.

    Attributes:
        heights: (R, C) z of the grid points, m: rows go along +y, columns along +x.
        size: Length along x and along y, m.
        position: (x, y) of the middle, m.
    """

    heights: np.ndarray
    size: tuple[float, float]
    position: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        heights = np.array(self.heights, float)
        if heights.ndim != 2 or min(heights.shape) < 2:
            raise _invalid("heights", "an array (R, C), both at least 2", str(heights.shape))
        if not np.isfinite(heights).all():
            raise _invalid("heights", "finite (m)", "NaN or infinity")
        _check_numbers("size", self.size, 2)
        if min(self.size) <= 0:
            raise _invalid("size", "two positive lengths (m)", repr(self.size))
        _check_numbers("position", self.position, 2)
        heights.setflags(write=False)
        object.__setattr__(self, "heights", heights)

    @property
    def spacing(self) -> np.ndarray:
        """(2,) distance of neighbouring grid points along x and y, m."""
        rows, columns = self.heights.shape
        return np.array(self.size) / (columns - 1, rows - 1)

    def vertices(self) -> np.ndarray:
        """(R, C, 3) grid points in the world, m."""
        rows, columns = self.heights.shape
        x = self.position[0] + self.size[0] * np.linspace(-0.5, 0.5, columns)
        y = self.position[1] + self.size[1] * np.linspace(-0.5, 0.5, rows)
        return np.stack([*np.meshgrid(x, y), self.heights], axis=-1)

    def mesh(self) -> trimesh.Trimesh:
        """Returns the surface, without sides and bottom."""
        index = np.arange(self.heights.size).reshape(self.heights.shape)
        low, high = index[:-1], index[1:]
        first = np.stack([low[:, :-1], low[:, 1:], high[:, 1:]], axis=-1)
        second = np.stack([low[:, :-1], high[:, 1:], high[:, :-1]], axis=-1)
        faces = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
        return trimesh.Trimesh(self.vertices().reshape(-1, 3), faces, process=False)

    def height_at(self, points: np.ndarray) -> np.ndarray:
        """(P,) height of the surface at (P, 2) places, m; -inf beside the field."""
        cell, inside = self._cells(points)
        u, v = np.moveaxis(self._grid(points) - cell, -1, 0)
        column, row = cell.T
        z = self.heights
        first, last = z[row, column], z[row + 1, column + 1]
        right, up = z[row, column + 1], z[row + 1, column]
        # The diagonal of a cell runs from its first to its last corner.
        below = first + u * (right - first) + v * (last - right)
        above = first + v * (up - first) + u * (last - up)
        return np.where(inside, np.where(u >= v, below, above), -np.inf)

    def closest_points(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Projects (P, 3) points onto the surface.

        Returns:
            (P, 3) surface points and (P,) signed distances, m, negative below. Exact up to two
            cells from the surface; farther off, distances are upper bounds. Beside the field: NaN
            and infinity.
        """
        points = np.asarray(points, float)
        cell, inside = self._cells(points[:, :2])
        grid = self.vertices()
        rows, columns = self.heights.shape
        best = np.full(len(points), np.inf)
        closest = np.full(points.shape, np.nan)
        for dx in range(-_NEIGHBOURS, _NEIGHBOURS + 1):
            for dy in range(-_NEIGHBOURS, _NEIGHBOURS + 1):
                c = np.clip(cell[:, 0] + dx, 0, columns - 2)
                r = np.clip(cell[:, 1] + dy, 0, rows - 2)
                diagonal = grid[r, c], grid[r + 1, c + 1]
                for corner in (grid[r, c + 1], grid[r + 1, c]):
                    found = closest_on_triangles(np.stack([corner, *diagonal], axis=1), points)
                    gap = np.linalg.norm(found - points, axis=1)
                    nearer = inside & (gap < best)
                    closest[nearer], best[nearer] = found[nearer], gap[nearer]
        below = points[:, 2] < self.height_at(points[:, :2])
        return closest, np.where(below, -best, best)

    def scaled(self, scale: np.ndarray) -> HeightField:
        """Returns the field scaled per axis by ``scale`` (3,) about the world origin."""
        x, y, z = (float(s) for s in scale)
        return HeightField(
            self.heights * z,
            (self.size[0] * x, self.size[1] * y),
            (self.position[0] * x, self.position[1] * y),
        )

    def _grid(self, points: np.ndarray) -> np.ndarray:
        """(P, 2) places in units of cells, from the first grid point."""
        low = np.array(self.position) - 0.5 * np.array(self.size)
        return (np.asarray(points, float) - low) / self.spacing

    def _cells(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(P, 2) column and row of the cell of every place, and (P,) whether it is in the field."""
        at, most = self._grid(points), np.array(self.heights.shape)[::-1] - 1
        inside = np.all((at >= 0) & (at <= most), axis=1)
        return np.clip(np.floor(at).astype(int), 0, most - 1), inside


def _invalid(field: str, expected: str, found: str) -> InvalidDataError:
    return InvalidDataError("HeightField", field, expected, found)


def _check_numbers(field: str, values: Sequence[float], count: int) -> None:
    if len(values) != count or not np.isfinite(values).all():
        raise _invalid(field, f"{count} finite numbers (m)", repr(values))
