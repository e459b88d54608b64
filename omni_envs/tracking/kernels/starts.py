"""How episodes start: where in which motion, on which clock, in which state."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from omni_envs.tracking.kernels.algebra import (
    copy_columns,
    matrix,
    product,
    quadruple,
    rotate,
    rotate_inverse,
    triple,
    write,
)
from omni_envs.tracking.kernels.compiled import Array, compiled
from omni_envs.tracking.kernels.plan import Numbers, clock_rows
from omni_envs.tracking.motion import Columns

NEVER = 2**62
"""Control steps until a push, or a time-out, that does not come."""


@compiled
def draw_frames(
    cumulative: Array, motions: Array, low: Array, width: Array, last: Array, draws: Array,
    out_motion: Array, out_frame: Array,
) -> None:  # fmt: skip
    """Draws (K,) motions and start frames, given (2, K) uniform draws in [0, 1).

    A draw chooses one of (C,) stretches of motion, whose ``cumulative`` shares are given, then a
    frame of its ``width`` from ``low`` on, at most the ``last`` of the motion, (M,).
    """
    for k in range(draws.shape[1]):
        c = min(np.searchsorted(cumulative, draws[0, k], side="right"), len(cumulative) - 1)
        out_motion[k] = motions[c]
        out_frame[k] = min(int(low[c] + draws[1, k] * width[c]), last[motions[c]])


@compiled
def start_clocks(
    clocks: Array, starts: Array, lengths: Array, motions: Array, frames: Array, most: int,
    pushes: Array, nominal: Array, half: float, draws: Array, ids: Array, out_motion: Array,
    out_default: Array, out_action: Array,
) -> None:  # fmt: skip
    """Starts the episodes of the simulations ``ids`` in (K,) frames of (K,) motions.

    ``starts`` and ``lengths`` are (M,) first rows and frames of the motions, ``most`` the control
    steps until the time-out, ``pushes`` the fewest and most control steps until a push, or empty,
    ``draws`` (1 + n, K) uniform in [0, 1): of the push, and of the default joint positions
    (rad), which lie ± ``half`` about the ``nominal`` ones.
    """
    now = clock_rows(clocks)
    for k in range(len(ids)):
        i, motion, frame = ids[k], motions[k], frames[k]
        out_motion[i] = motion
        now.first[i], now.last[i] = starts[motion], lengths[motion] - 1
        now.elapsed[i], now.frame[i] = 0, frame + 1
        now.rows[i] = starts[motion] + frame + 1
        now.possible[i] = min(now.last[i] - frame, most)
        now.next_push[i] = next_push(pushes, draws[0, k])
        for j in range(len(nominal)):
            out_default[i, j] = nominal[j] + (2.0 * draws[1 + j, k] - 1.0) * half
            out_action[i, j] = 0.0


@compiled
def next_push(pushes: Array, draw: float) -> int:
    """Control steps until a push; see ``start_clocks``."""
    if len(pushes) == 0:
        return NEVER
    return max(int(np.rint(pushes[0] + (pushes[1] - pushes[0]) * draw)), 1)


@compiled
def start_states(
    numbers: Numbers, at: Columns, table: Array, rows: Array, draws: Array, widths: Array,
    ids: Array, out_qpos: Array, out_qvel: Array,
) -> None:  # fmt: skip
    """Puts the simulations ``ids`` a row before their (N,) rows, disturbed: see ``start_state``.

    ``draws`` is (15 + n, K), uniform in [0, 1), and ``widths`` (K, 15 + n) or (1, 15 + n), half
    widths of root position, orientation, linear and angular velocity, object position and joints;
    or both are empty.
    """
    n, nq, nv = len(numbers.lower), numbers.root_nq, numbers.root_nv
    d = np.empty(15 + n)
    for k in range(len(ids)):
        i = ids[k]
        r = rows[i] - 1
        copy_columns(out_qpos, i, 0, table, r, at.qpos, nq)
        copy_columns(out_qvel, i, 0, table, r, at.qvel, nv)
        if numbers.has_object:
            copy_columns(out_qpos, i, nq, table, r, at.object_pose, 7)
            copy_columns(out_qvel, i, nv, table, r, at.object_velocity, 3)
            m = matrix(quadruple(table, r, at.object_pose + 3))
            spin = rotate_inverse(m, triple(table, r, at.object_velocity + 3))
            write(out_qvel, i, nv + 3, spin)
        if len(widths) == 0:
            continue
        wide = min(k, len(widths) - 1)
        for c in range(15 + n):
            d[c] = (2.0 * draws[c, k] - 1.0) * widths[wide, c]
        roll, pitch, yaw = 0.5 * d[3], 0.5 * d[4], 0.5 * d[5]
        about_z, about_y = (cos(yaw), 0.0, 0.0, sin(yaw)), (cos(pitch), 0.0, sin(pitch), 0.0)
        turn = product(product(about_z, about_y), (cos(roll), sin(roll), 0.0, 0.0))
        q = quadruple(out_qpos, i, 3)
        turned = product(turn, q)
        spin = rotate(matrix(q), triple(out_qvel, i, 3))
        spin = (spin[0] + d[9], spin[1] + d[10], spin[2] + d[11])
        write(out_qpos, i, 3, turned)
        write(out_qvel, i, 3, rotate_inverse(matrix(turned), spin))
        for c in range(3):
            out_qpos[i, c] += d[c]
            out_qvel[i, c] += d[6 + c]
            if numbers.has_object:
                out_qpos[i, nq + c] += d[12 + c]
        for j in range(n):
            joint = out_qpos[i, 7 + j] + d[15 + j]
            out_qpos[i, 7 + j] = min(max(joint, numbers.lower[j]), numbers.upper[j])
