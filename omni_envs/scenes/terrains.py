"""Scenes to climb and crawl on, from a few numbers, mesh files or heights.

All stand on the ground z = 0 and are at the scale of whoever moves in them: at human scale they
belong to a ``Demonstration`` and shrink with the person when that is scaled to a robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from omni_envs.errors import InvalidDataError
from omni_envs.scenes.heightfield import HeightField
from omni_envs.scenes.scene import Scene, Terrain
from omni_envs.scenes.shapes import Box, ConvexMesh, Part, load_convex_parts


def platform(height: float, depth: float, width: float = 1.6, edge: float = 0.0) -> Scene:
    """A platform in front of someone who looks along +x.

    Args:
        height: Of its top over the ground, m.
        depth: Along x, m.
        width: Along y, m.
        edge: x of its front edge, m.

    Raises:
        InvalidDataError: A length is not positive, or the edge is not finite.
    """
    return stacked_platforms([(height, depth)], width, edge)


def stacked_platforms(
    steps: Sequence[tuple[float, float]], width: float = 1.6, edge: float = 0.0
) -> Scene:
    """Platforms one behind the other along +x, each with its own height: stairs, a tower, a ditch.

    Args:
        steps: (height, depth) of every platform, m, from the front; the height of each is that of
            its top over the ground.
        width: Along y, m.
        edge: x of the front edge of the first, m.

    Raises:
        InvalidDataError: There is no platform, a length is not positive, or the edge is not finite.
    """
    if not len(steps):
        raise InvalidDataError("Platforms", "steps", "at least one (height, depth)", "none")
    _check("Platforms", "edge", edge)
    _check("Platforms", "width", width, positive=True)
    parts = []
    for number, step in enumerate(steps):
        if len(step) != 2:
            raise InvalidDataError("Platforms", f"steps[{number}]", "(height, depth)", repr(step))
        height, depth = step
        _check("Platforms", f"steps[{number}] height", height, positive=True)
        _check("Platforms", f"steps[{number}] depth", depth, positive=True)
        half = (0.5 * float(depth), 0.5 * float(width), 0.5 * float(height))
        parts.append(Part(Box(half), (float(edge) + half[0], 0.0, half[2])))
        edge = edge + depth
    return Scene(terrain=Terrain(tuple(parts)))


def slope_onto_block(
    angle: float, height: float, depth: float, width: float = 1.6, foot: float = 0.0
) -> Scene:
    """A slope that rises along +x from the ground onto a block.

    Args:
        angle: Of the slope, rad.
        height: Of the block, m.
        depth: Of the block along x, m.
        width: Along y, m.
        foot: x where the slope begins, m.

    Raises:
        InvalidDataError: A length is not positive, or the angle is not in (0, 80°).
    """
    owner = "Slope"
    for name, value in (("height", height), ("depth", depth), ("width", width)):
        _check(owner, name, value, positive=True)
    _check(owner, "foot", foot)
    if not 0 < angle < np.deg2rad(80.0):
        raise InvalidDataError(owner, "angle", "between 0 and 80° (rad)", repr(angle))
    length, side = float(height / np.tan(angle)), 0.5 * float(width)
    start, end = float(foot), float(foot) + length
    profile = ((start, 0.0), (end, 0.0), (end, float(height)))
    wedge = np.array([[x, y, z] for y in (-side, side) for x, z in profile])
    faces = [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [0, 2, 5], [0, 5, 3]]
    half = (0.5 * float(depth), side, 0.5 * float(height))
    block = Part(Box(half), (end + half[0], 0.0, half[2]))
    return Scene(terrain=Terrain((Part(ConvexMesh(wedge, np.array(faces))), block)))


def mesh_terrain(*paths: str | Path) -> Scene:
    """Terrain from mesh files whose connected pieces are convex: see ``load_convex_parts``.

    Raises:
        InvalidDataError: No file is named.
        FileFormatError: A file cannot be used; the message says which part and why.
    """
    parts = tuple(part for path in paths for part in load_convex_parts(path))
    return Scene(terrain=Terrain(parts))


def uneven_ground(
    heights: np.ndarray, size: tuple[float, float], position: tuple[float, float] = (0.0, 0.0)
) -> Scene:
    """A height field on the ground: see ``HeightField``.

    Raises:
        InvalidDataError: The heights are not a finite grid, or the size is not positive.
    """
    return Scene(terrain=Terrain((), HeightField(heights, size, position)))


def _check(owner: str, field: str, value: float, positive: bool = False) -> None:
    if not np.isfinite(value) or (positive and value <= 0):
        expected = "positive (m)" if positive else "finite (m)"
        raise InvalidDataError(owner, field, expected, repr(value))
