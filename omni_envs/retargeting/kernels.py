"""The inner loops of a step, compiled: what is asked for once per quadratic program.

Numba compiles them on first use and keeps the result on disk, see ``omni_envs.compilation``. Pure
functions of arrays; no fast mathematics, so that the same input gives the same bits.
"""

from __future__ import annotations

import numpy as np

from omni_envs.compilation import Compiler

Array = np.ndarray
_compiled = Compiler(__file__)


@_compiled
def positions(xpos: Array, xmat: Array, bodies: Array, offsets: Array) -> Array:
    """(K, 3) world positions of (K, 3) offsets in the frames of (K,) bodies."""
    out = np.empty((len(bodies), 3))
    for k in range(len(bodies)):
        b = bodies[k]
        x, y, z = offsets[k, 0], offsets[k, 1], offsets[k, 2]
        for i in range(3):
            R = xmat[b, 3 * i : 3 * i + 3]
            out[k, i] = xpos[b, i] + R[0] * x + R[1] * y + R[2] * z
    return out


@_compiled
def jacobians(cdof: Array, centre: Array, moves: Array, bodies: Array, points: Array) -> Array:
    """(3, K, nv) Jacobians of (K, 3) world points of (K,) bodies.

    J = linear + angular × (p - centre) for the degrees of freedom that move the body.

    Args:
        cdof: (nv, 6) spatial axes, angular part first.
        centre: (3,) where they are taken.
        moves: (nbody, nv) 1 where a degree of freedom moves a body.
        bodies: (K,).
        points: (K, 3).
    """
    count, nv = len(bodies), len(cdof)
    out = np.empty((3, count, nv))
    for k in range(count):
        x, y, z = points[k, 0] - centre[0], points[k, 1] - centre[1], points[k, 2] - centre[2]
        mask = moves[bodies[k]]
        for v in range(nv):
            if mask[v] == 0.0:
                out[0, k, v] = out[1, k, v] = out[2, k, v] = 0.0
                continue
            wx, wy, wz = cdof[v, 0], cdof[v, 1], cdof[v, 2]
            out[0, k, v] = cdof[v, 3] + wy * z - wz * y
            out[1, k, v] = cdof[v, 4] + wz * x - wx * z
            out[2, k, v] = cdof[v, 5] + wx * y - wy * x
    return out


@_compiled
def contact_rows(
    cdof: Array, centre: Array, moves: Array, bodies: Array, points: Array, normals: Array
) -> Array:
    """(N, nv) rows n·(J₂ - J₁) at (N, 3) points between (N, 2) bodies; see ``jacobians``."""
    count, nv = len(bodies), len(cdof)
    out = np.empty((count, nv))
    for i in range(count):
        x, y, z = points[i, 0] - centre[0], points[i, 1] - centre[1], points[i, 2] - centre[2]
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        tx, ty, tz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
        first, second = moves[bodies[i, 0]], moves[bodies[i, 1]]
        for v in range(nv):
            sign = second[v] - first[v]
            if sign == 0.0:
                out[i, v] = 0.0
                continue
            turn = tx * cdof[v, 0] + ty * cdof[v, 1] + tz * cdof[v, 2]
            out[i, v] = sign * (turn + nx * cdof[v, 3] + ny * cdof[v, 4] + nz * cdof[v, 5])
    return out


@_compiled
def coupled_squares(jacobian: Array, coupling: Array, force: Array) -> tuple[Array, Array]:
    """H = Σ_d J_dᵀ M J_d and g = Σ_d J_dᵀ f_d of (3, K, nv) Jacobians, which are sparse.

    Args:
        jacobian: (3, K, nv).
        coupling: (K, K) M, symmetric.
        force: (K, 3) f.
    """
    count, nv = jacobian.shape[1:]
    H, g = np.zeros((nv, nv)), np.zeros(nv)
    row = np.empty(nv)
    for d in range(3):
        for k in range(count):
            row[:] = 0.0
            for j in range(count):
                weight = coupling[k, j]
                if weight != 0.0:
                    for v in range(nv):
                        row[v] += weight * jacobian[d, j, v]
            for u in range(nv):
                slope = jacobian[d, k, u]
                if slope != 0.0:
                    g[u] += slope * force[k, d]
                    for v in range(u, nv):
                        H[u, v] += slope * row[v]
    for u in range(nv):
        for v in range(u):
            H[u, v] = H[v, u]
    return H, g


@_compiled
def weighted_squares(
    jacobian: Array, residual: Array, weights: Array
) -> tuple[Array, Array, float]:
    """H = JᵀWJ, g = JᵀWr and ½ rᵀWr of (N, nv) rows, which are sparse."""
    count, nv = jacobian.shape
    H, g, value = np.zeros((nv, nv)), np.zeros(nv), 0.0
    for i in range(count):
        value += 0.5 * weights[i] * residual[i] * residual[i]
        for u in range(nv):
            slope = weights[i] * jacobian[i, u]
            if slope != 0.0:
                g[u] += slope * residual[i]
                for v in range(u, nv):
                    H[u, v] += slope * jacobian[i, v]
    for u in range(nv):
        for v in range(u):
            H[u, v] = H[v, u]
    return H, g, value


@_compiled
def selected_squares(
    select: Array, values: Array, jacobian: Array, targets: Array, weights: Array
) -> tuple[Array, Array, float]:
    """H, g and value of ½ Σ w (s·x - target)² over N rows s of (M,) values x; rows are sparse.

    Args:
        select: (N, M).
        values: (M,) x.
        jacobian: (M, nv) of x.
        targets: (N,).
        weights: (N,) w.
    """
    (count, size), nv = select.shape, jacobian.shape[1]
    rows, residual = np.zeros((count, nv)), -targets
    for i in range(count):
        for m in range(size):
            factor = select[i, m]
            if factor != 0.0:
                residual[i] += factor * values[m]
                for v in range(nv):
                    rows[i, v] += factor * jacobian[m, v]
    return weighted_squares(rows, residual, weights)


@_compiled
def lowest_points(points: Array, normals: Array) -> tuple[Array, Array]:
    """(F,) least heights along (F, 3) normals of (F, K, 3) points, and the (F, 3) points."""
    count, size = points.shape[:2]
    heights, lowest = np.full(count, np.inf), np.zeros((count, 3))
    for f in range(count):
        for k in range(size):
            height = 0.0
            for d in range(3):
                height += normals[f, d] * points[f, k, d]
            if height < heights[f]:
                heights[f], lowest[f] = height, points[f, k]
    return heights, lowest


@_compiled
def worst_violations(lower: Array, upper: Array, kind: Array, kinds: int) -> Array:
    """(kinds,) largest violation of lower ≤ 0 ≤ upper by kind, 0 for none."""
    worst = np.zeros(kinds)
    for i in range(len(kind)):
        excess = max(lower[i], -upper[i])
        worst[kind[i]] = max(worst[kind[i]], excess)
    return worst


@_compiled
def contact_sides(
    geoms: Array, geom_bodies: Array, distances: Array, moves: Array, tolerance: float
) -> tuple[Array, Array, Array]:
    """Bodies, sort and bound of N contacts: n·(J₂ - J₁) dq ≥ lower.

    Args:
        geoms: (N, 2) geoms.
        geom_bodies: Geom to body.
        distances: (N,).
        moves: (nbody, nv); the first degree of freedom moves every body of the robot, and nothing
            else.
        tolerance: Accepted depth of what is not between two bodies of the robot.

    Returns:
        (N, 2) bodies, (N,) whether both belong to the robot as 1 or 0, (N,) lower.
    """
    count = len(distances)
    bodies, own, lower = np.empty((count, 2), np.int64), np.zeros(count, np.int64), np.empty(count)
    for i in range(count):
        first, second = geom_bodies[geoms[i, 0]], geom_bodies[geoms[i, 1]]
        bodies[i, 0], bodies[i, 1] = first, second
        if moves[first, 0] != 0.0 and moves[second, 0] != 0.0:
            own[i], lower[i] = 1, -distances[i]
        else:
            lower[i] = -distances[i] - tolerance
    return bodies, own, lower


@_compiled
def reduced_energies(
    adjacency: Array, source: Array, target: Array, keypoints: int
) -> tuple[Array, Array, Array]:
    """Deformation energies about the keypoints, the first vertices of a mesh per frame.

    E(P) = tr(PᵀMP) + 2 tr(cᵀP) + e with M = L_kᵀL_k, c = L_kᵀr, e = ‖r‖², r = L_o P_o - L P_source.

    Args:
        adjacency: (T, V, ⌈V/8⌉) packed bits.
        source: (T, V, 3) P_source.
        target: (T or 1, V - K, 3) P_o.
        keypoints: K.

    Returns:
        (T, K, K) M, (T, K, 3) c and (T,) e.
    """
    frames, vertices = source.shape[:2]
    M = np.zeros((frames, keypoints, keypoints))
    c, e = np.zeros((frames, keypoints, 3)), np.zeros(frames)
    row, columns, r = np.empty(keypoints), np.empty(keypoints, np.int64), np.empty(3)
    neighbours = np.empty(vertices, np.int64)
    for t in range(frames):
        surface = target[min(t, len(target) - 1)]
        for i in range(vertices):
            degree = 0
            for j in range(vertices):
                if adjacency[t, i, j >> 3] >> (7 - (j & 7)) & 1:
                    neighbours[degree] = j
                    degree += 1
            if degree == 0:
                continue
            found = 0
            for d in range(3):
                r[d] = -source[t, i, d]
            if i < keypoints:
                columns[found], row[found] = i, 1.0
                found += 1
            else:
                for d in range(3):
                    r[d] += surface[i - keypoints, d]
            for n in range(degree):
                j = neighbours[n]
                if j < keypoints:
                    columns[found], row[found] = j, -1.0 / degree
                    found += 1
                for d in range(3):
                    other = source[t, j, d]
                    if j >= keypoints:
                        other -= surface[j - keypoints, d]
                    r[d] += other / degree
            for d in range(3):
                e[t] += r[d] * r[d]
            for a in range(found):
                for d in range(3):
                    c[t, columns[a], d] += row[a] * r[d]
                for b in range(found):
                    M[t, columns[a], columns[b]] += row[a] * row[b]
    return M, c, e


@_compiled
def farthest_points(points: Array, stretch: Array, count: int) -> Array:
    """Indices of points, each the farthest from those chosen before it; the first is the first.

    Args:
        points: (N, 3).
        stretch: (N,) factor on the distances of each point.
        count: How many to choose.
    """
    chosen = np.zeros(count, np.int64)
    distance = np.full(len(points), np.inf)
    for i in range(1, count):
        last, best = points[chosen[i - 1]], 0
        for n in range(len(points)):
            x, y, z = points[n, 0] - last[0], points[n, 1] - last[1], points[n, 2] - last[2]
            distance[n] = min(distance[n], np.sqrt(x * x + y * y + z * z) * stretch[n])
            if distance[n] > distance[best]:
                best = n
        chosen[i] = best
    return chosen
