"""Rewards and terminations of a control step."""

from __future__ import annotations

from math import atan2, cos, exp, sin, sqrt

import numpy as np

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.kernels.algebra import (
    conjugate,
    dot,
    gravity_z,
    product,
    quadruple,
    quaternion_of,
    squared_angle,
    squared_distance,
    triple,
    vector_of,
)
from omni_envs.tracking.kernels.compiled import Array, compiled
from omni_envs.tracking.kernels.plan import Numbers
from omni_envs.tracking.motion import Columns


@compiled
def _contacts(history: Array, i: int, numbers: Numbers) -> int:
    """Bodies, or physics steps, with a contact force above the threshold.

    A sensor's row of the history is: user value, cursor, the samples' times, the samples.
    """
    samples = numbers.samples
    size = 2 + 4 * samples
    least = numbers.contact_force * numbers.contact_force
    sensors = history.shape[1] // size
    outer, inner = (samples, sensors) if numbers.by_substep else (sensors, samples)
    count = 0
    for a in range(outer):
        for b in range(inner):
            sensor, sample = (b, a) if numbers.by_substep else (a, b)
            f = triple(history, i, sensor * size + 2 + samples + 3 * sample)
            if f[0] * f[0] + f[1] * f[1] + f[2] * f[2] > least:
                count += 1
                break
    return count


@compiled
def judge(
    numbers: Numbers, at: Columns, table: Array, rows: Array, qpos: Array, bodies: Bodies,
    action: Array, previous: Array, history: Array, object_active: bool, diverged: Array,
    ids: Array, out_figures: Array, out_flags: Array, out_reward: Array, out_terminated: Array,
) -> None:  # fmt: skip
    """Rewards and terminations: see ``rewards``, ``terminations`` and ``alignment``.

    Of the simulations ``ids``. Writes (terms + errors, N) weighted rewards and roots of the squared
    errors, (5, N) the four tests and whether the simulation diverged, in which case there is no
    reward, (N,) sums of the rewards and (N,) whether any flag is set.
    """
    position, turns = bodies.position, bodies.quaternion
    count, a = position.shape[1], numbers.anchor
    limits, tracking = numbers.thresholds, len(numbers.columns)
    n, nq = len(numbers.lower), numbers.root_nq
    e = np.zeros(8)
    oriented = 0
    for b in range(count):
        oriented += numbers.oriented[b]
    for i in ids:
        r = rows[i]
        p, q = vector_of(position, i, a), quaternion_of(turns, i, a)
        rp = triple(table, r, at.position + 3 * a)
        rq = quadruple(table, r, at.quaternion + 4 * a)
        e[0] = squared_distance(p, rp)
        e[1] = squared_angle(dot(q, rq))
        d = product(q, conjugate(rq))
        half = 0.5 * atan2(
            2.0 * (d[0] * d[3] + d[1] * d[2]), 1.0 - 2.0 * (d[2] * d[2] + d[3] * d[3])
        )
        c, s = cos(half), sin(half)
        cosine, sine = c * c - s * s, 2.0 * c * s
        place_error, angle_error, linear_error, angular_error = 0.0, 0.0, 0.0, 0.0
        for b in range(count):
            # The reference's body, turned and moved to the robot's anchor but for its height.
            place = triple(table, r, at.position + 3 * b)
            x, y = place[0] - rp[0], place[1] - rp[1]
            moved = (p[0] + cosine * x - sine * y, p[1] + sine * x + cosine * y, place[2])
            place_error += squared_distance(vector_of(position, i, b), moved)
            if numbers.oriented[b]:
                o, t = quaternion_of(turns, i, b), quadruple(table, r, at.quaternion + 4 * b)
                turned = o[3] * t[0] + o[2] * t[1] - o[1] * t[2] - o[0] * t[3]
                angle_error += squared_angle(c * dot(o, t) + s * turned)
            linear = vector_of(bodies.linear_velocity, i, b)
            linear_error += squared_distance(linear, triple(table, r, at.linear + 3 * b))
            angular = vector_of(bodies.angular_velocity, i, b)
            angular_error += squared_distance(angular, triple(table, r, at.angular + 3 * b))
        e[2] = place_error / count
        e[3] = angle_error / oriented
        e[4] = linear_error / count
        e[5] = angular_error / count
        if numbers.has_object:
            e[6] = squared_distance(triple(qpos, i, nq), triple(table, r, at.object_pose))
            e[7] = squared_angle(
                dot(quadruple(qpos, i, nq + 3), quadruple(table, r, at.object_pose + 3))
            )
        out_flags[0, i] = abs(p[2] - rp[2]) > limits[0]
        out_flags[1, i] = abs(gravity_z(q) - gravity_z(rq)) > limits[1]
        dropped = False
        for b in numbers.end_effectors:
            dropped |= abs(position[i, b, 2] - table[r, at.position + 3 * b + 2]) > limits[2]
        out_flags[2, i] = dropped
        lost = e[6] > limits[3] * limits[3] or e[7] > limits[4] * limits[4]
        out_flags[3, i] = lost and object_active
        out_flags[4, i] = diverged[i]
        terminated = diverged[i]
        for k in range(4):
            terminated |= out_flags[k, i]
        out_terminated[i] = terminated
        for k in range(tracking + 3, len(out_figures)):
            out_figures[k, i] = sqrt(e[k - tracking - 3])
        change, excess = 0.0, 0.0
        for j in range(n):
            step = action[i, j] - previous[i, j]
            change += step * step
            joint = qpos[i, 7 + j]
            excess += max(joint - numbers.upper[j], numbers.lower[j] - joint, 0.0)
        reward = 0.0
        penalties = (change, excess, float(_contacts(history, i, numbers)))
        for k in range(tracking + 3):
            if k < tracking:
                value = exp(e[numbers.columns[k]] * numbers.inverse_variance[k])
            else:
                value = penalties[k - tracking]
            term = 0.0 if diverged[i] else value * numbers.weights[k]
            out_figures[k, i] = term
            reward += term
        out_reward[i] = reward
