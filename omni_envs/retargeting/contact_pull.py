"""The pull of a link towards a place that it is to touch, compiled (see ``ContactTask``)."""

from __future__ import annotations

import numpy as np

from omni_envs.compilation import Compiler

Array = np.ndarray
_compiled = Compiler(__file__)

SOFT = 2e-3
"""Width of the edge of the dead zone, m: over a sharp one a step is either too short or too far."""
FULL, FADES = 0.01, 0.08
"""Gaps at which the pull is full, and from which on it fades, m: what a robot cannot reach is no
reason to contort it."""


@_compiled
def pull(distance: float) -> tuple[float, float, float]:
    """The loss ρ(g(d)) of a distance from the edge of the dead zone, negative within, m.

    The gap g(d) = ½ (d + √(d² + s²)) is d beyond the edge and fades within. ρ(g) = ½ g² up to
    a = ``FULL``; its force a stays up to b = ``FADES`` and falls with a (b/g)² beyond.

    Returns:
        Value, slope and curvature. Beyond ``FULL`` the curvature is that of the parabola in g that
        touches the loss and lies above it, as the true one, 0 or less, makes steps overshoot.
    """
    root = np.sqrt(distance * distance + SOFT * SOFT)
    gap = 0.5 * (distance + root) if distance > 0.0 else 0.5 * SOFT * SOFT / (root - distance)
    share, value = 1.0, 0.5 * gap * gap
    if gap > FULL:
        share = FULL / gap * min(1.0, FADES / gap) ** 2
        value = FULL * (min(gap, FADES) - 0.5 * FULL)
        value += FULL * max(FADES - FADES * FADES / gap, 0.0)
    grows = gap / root
    bends = 0.5 * SOFT * SOFT / (root * root * root)
    return value, share * gap * grows, share * (grows * grows + gap * bends)


@_compiled
def nearest_box(
    xpos: Array, xmat: Array, geoms: Array, half: Array, radius: Array, place: Array
) -> tuple[int, Array, float, Array]:
    """The box, grown by a radius, that is nearest to a place.

    Args:
        xpos: Places of all geoms.
        xmat: Rotations of all geoms.
        geoms: (G,) the boxes' geoms.
        half: (G, 3) half extents.
        radius: (G,).
        place: (3,).

    Returns:
        Its index in ``geoms``, the (3,) unit vector from the box that is not grown to the place, 0
        inside, the way's length, and the (3, 3) projector onto the axes on which the place is
        beyond the box: along the others the nearest point slides as the box moves.
    """
    best, least, length = 0, np.inf, 0.0
    local, unit, beyond = np.empty(3), np.zeros(3), np.zeros((3, 3))
    outside = np.zeros(3, np.bool_)
    for i in range(len(geoms)):
        R, centre = xmat[geoms[i]], xpos[geoms[i]]
        square = 0.0
        for j in range(3):
            along = 0.0
            for k in range(3):
                along += R[3 * k + j] * (place[k] - centre[k])
            local[j] = along - min(max(along, -half[i, j]), half[i, j])
            outside[j] = abs(along) >= half[i, j]
            square += local[j] * local[j]
        distance = np.sqrt(square)
        if distance - radius[i] < least:
            best, least, length = i, distance - radius[i], distance
            inverse = 1.0 / max(distance, 1e-12)
            for k in range(3):
                way = R[3 * k] * local[0] + R[3 * k + 1] * local[1] + R[3 * k + 2] * local[2]
                unit[k] = way * inverse
                for m in range(3):
                    beyond[k, m] = 0.0
                    for j in range(3):
                        if outside[j]:
                            beyond[k, m] += R[3 * k + j] * R[3 * m + j]
    return best, unit, length, beyond


@_compiled
def pulls(
    jacobian: Array, units: Array, distances: Array, lengths: Array, beyond: Array, weights: Array
) -> tuple[Array, Array, float]:
    """H, g and value of Σ w ρ of K links, of second order in the motion of the nearest points.

    Across its direction u a distance bends by (C - uuᵀ)/ℓ.

    Args:
        jacobian: (3, K, nv) of the nearest points.
        units: (K, 3) u, from there to the places.
        distances: (K,) from the edge of the dead zone.
        lengths: (K,) ℓ, from the core of the link; at least the width of the dead zone.
        beyond: (K, 3, 3) C.
        weights: (K,) w.
    """
    count, nv = jacobian.shape[1:]
    H, g, value = np.zeros((nv, nv)), np.zeros(nv), 0.0
    row = np.empty(nv)
    for k in range(count):
        loss, slope, along = pull(distances[k])
        value += weights[k] * loss
        across = slope / lengths[k]
        for i in range(3):
            row[:] = 0.0
            for j in range(3):
                turn = units[k, i] * units[k, j]
                factor = weights[k] * (along * turn + across * (beyond[k, i, j] - turn))
                for v in range(nv):
                    row[v] += factor * jacobian[j, k, v]
            force = -weights[k] * slope * units[k, i]
            for u in range(nv):
                move = jacobian[i, k, u]
                if move != 0.0:
                    g[u] += force * move
                    for v in range(u, nv):
                        H[u, v] += move * row[v]
    for u in range(nv):
        for v in range(u):
            H[u, v] = H[v, u]
    return H, g, value
