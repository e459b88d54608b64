"""What policy and critic see."""

from __future__ import annotations

import numpy as np

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.kernels.algebra import (
    conjugate,
    copy_columns,
    matrix,
    product,
    quadruple,
    quaternion_of,
    rotate_inverse,
    triple,
    vector_of,
    write,
    write_rot6d,
)
from omni_envs.tracking.kernels.compiled import Array, Tuple, compiled
from omni_envs.tracking.kernels.plan import Numbers
from omni_envs.tracking.motion import Columns


@compiled
def uniform(seed: int, k: int) -> float:
    """The k-th number in [0, 1) of a stream of chance: SplitMix64's scrambling of a counter."""
    z = np.uint64(seed) + np.uint64(k + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.float64((z ^ (z >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53


@compiled
def _write_policy(
    out: Array, i: int, estimated: bool, table: Array, row: int, at: Columns, rp: Tuple,
    turn: Tuple, anchor_p: Tuple, anchor_m: Tuple, qpos: Array, qvel: Array, default: Array,
    action: Array,
) -> int:  # fmt: skip
    n = default.shape[1]
    k = copy_columns(out, i, 0, table, row, at.qpos + 7, n)
    k = copy_columns(out, i, k, table, row, at.qvel + 6, n)
    if estimated:
        offset = (rp[0] - anchor_p[0], rp[1] - anchor_p[1], rp[2] - anchor_p[2])
        k = write(out, i, k, rotate_inverse(anchor_m, offset))
    k = write_rot6d(out, i, k, turn)
    if estimated:
        base = matrix(quadruple(qpos, i, 3))
        k = write(out, i, k, rotate_inverse(base, triple(qvel, i, 0)))
    k = write(out, i, k, triple(qvel, i, 3))
    for j in range(n):
        out[i, k + j] = qpos[i, 7 + j] - default[i, j]
        out[i, k + n + j] = qvel[i, 6 + j]
        out[i, k + 2 * n + j] = action[i, j]
    return k + 3 * n


@compiled
def observe(
    numbers: Numbers, at: Columns, table: Array, rows: Array, qpos: Array, qvel: Array,
    bodies: Bodies, default: Array, action: Array, seed: int, share: float, ids: Array,
    out_policy: Array, out_critic: Array,
) -> None:  # fmt: skip
    """Observations of the simulations ``ids``: see ``observations``.

    The noise follows from the ``seed``, ``share`` is how much of it there is; ``out_critic`` is
    (N, size) or (0, 0).
    """
    noisy = len(numbers.noise_width)
    noise = np.empty(noisy)
    a, nq, estimated = numbers.anchor, numbers.root_nq, numbers.state_estimation
    position, turns = bodies.position, bodies.quaternion
    for i in ids:
        r = rows[i]
        rp = triple(table, r, at.position + 3 * a)
        rq = quadruple(table, r, at.quaternion + 4 * a)
        p, q = vector_of(position, i, a), quaternion_of(turns, i, a)
        back, m = conjugate(q), matrix(q)
        turn = matrix(product(back, rq))
        _write_policy(
            out_policy, i, estimated, table, r, at, rp, turn, p, m, qpos, qvel, default, action
        )
        for k in range(noisy):
            noise[k] = uniform(seed, i * noisy + k) - 0.5
        for k in range(noisy):
            out_policy[i, numbers.noise_start + k] += share * noise[k] * numbers.noise_width[k]
        if len(out_critic) == 0:
            continue
        k = _write_policy(  # bool(1): for True it would be compiled once more
            out_critic, i, bool(1), table, r, at, rp, turn, p, m, qpos, qvel, default, action
        )
        for b in range(position.shape[1]):
            x = vector_of(position, i, b)
            offset = (x[0] - p[0], x[1] - p[1], x[2] - p[2])
            k = write(out_critic, i, k, rotate_inverse(m, offset))
        for b in range(position.shape[1]):
            k = write_rot6d(out_critic, i, k, matrix(product(back, quaternion_of(turns, i, b))))
        if numbers.has_object:
            x = triple(qpos, i, nq)
            offset = (x[0] - p[0], x[1] - p[1], x[2] - p[2])
            k = write(out_critic, i, k, rotate_inverse(m, offset))
            turn = matrix(product(back, quadruple(qpos, i, nq + 3)))
            k = write_rot6d(out_critic, i, k, turn)
            write(out_critic, i, k, rotate_inverse(m, triple(qvel, i, numbers.root_nv)))
