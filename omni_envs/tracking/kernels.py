"""The task compiled: for each simulation everything in one pass, without temporary arrays.

What is computed here is defined by the plain functions on arrays (``alignment``, ``rewards``,
``terminations``, ``observations``, ``randomization``); a test holds these loops to them. Numba
compiles on first use and keeps the result in its cache next to this file, or in the user's cache
directory where that cannot be written. No fast mathematics: the same input gives the same bits.

Arrays named ``out`` are written to. ``rows`` are rows of ``MotionLibrary.table``, ``at`` are its
columns.
"""

from __future__ import annotations

from math import acos, atan2, cos, exp, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.motion import Columns

Array = np.ndarray
Tuple = Any
"""A few numbers: a tuple or a row of an array."""

_compiled = njit(cache=True, nogil=True, error_model="numpy")
_HALF = np.float32(0.5)


class Tree(NamedTuple):
    """The bodies of a robot, parents first, as far as tracked bodies hang on them.

    Attributes:
        parent: (K,) index of the parent, -1 for the root.
        slot: (K,) index among the tracked bodies, or -1.
        position: (K, 3) in the parent, m.
        quaternion: (K, 4) in the parent.
        first: (K + 1,) first hinge of every body; those of body k are first[k] … first[k + 1] - 1.
        axis: (J, 3) hinge axes in their body.
        anchor: (J, 3) a point of the axis in its body, m.
        zero: (J,) joint position at which the body is placed as above, rad.
        joint: (J,) index of the hinge among all.
    """

    parent: Array
    slot: Array
    position: Array
    quaternion: Array
    first: Array
    axis: Array
    anchor: Array
    zero: Array
    joint: Array


class Numbers(NamedTuple):
    """What of a configuration the loops need.

    Attributes:
        anchor: Index of the anchor among the tracked bodies.
        root_nq: Length of the robot's qpos.
        root_nv: Length of the robot's qvel.
        has_object: Whether there is an object.
        oriented: (B,) bool, bodies whose orientation counts.
        end_effectors: Indices among the tracked bodies.
        lower: (n,) soft joint limits, rad.
        upper: (n,) rad.
        columns: (K,) which squared errors make tracking terms.
        inverse_variance: (K,) -1 / σ².
        weights: (K + 3,) of the tracking terms and the penalties, per control step.
        samples: Physics steps that a contact sensor remembers.
        by_substep: Count substeps in contact instead of bodies.
        contact_force: Smallest force that counts, N.
        thresholds: (5,) anchor height, anchor tilt, end-effector height, object distance, angle.
        state_estimation: Whether the policy sees what has to be estimated.
        noise_start: First noisy entry of the policy's observation.
        noise_width: (W,) widths of the noise from there on, float32.
    """

    anchor: int
    root_nq: int
    root_nv: int
    has_object: bool
    oriented: Array
    end_effectors: Array
    lower: Array
    upper: Array
    columns: Array
    inverse_variance: Array
    weights: Array
    samples: int
    by_substep: bool
    contact_force: float
    thresholds: Array
    state_estimation: bool
    noise_start: int
    noise_width: Array


class Clocks(NamedTuple):
    """Where N episodes are; see ``Episodes``.

    Attributes:
        rows: (N,) row of the table to track next: first + frame.
        frame: (N,) frame of the motion.
        first: (N,) first row of the motion.
        last: (N,) last frame of the motion.
        elapsed: (N,) control steps since the start.
        possible: (N,) control steps until motion or time is over.
        next_push: (N,) control steps until the next push.
    """

    rows: Array
    frame: Array
    first: Array
    last: Array
    elapsed: Array
    possible: Array
    next_push: Array


@_compiled
def _product(a: Tuple, b: Tuple) -> Tuple:
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@_compiled
def _conjugate(q: Tuple) -> Tuple:
    return (q[0], -q[1], -q[2], -q[3])


@_compiled
def _matrix(q: Tuple) -> Tuple:
    """The nine entries by rows."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (
        w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z,
    )  # fmt: skip


@_compiled
def _rotate(m: Tuple, v: Tuple) -> Tuple:
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@_compiled
def _rotate_inverse(m: Tuple, v: Tuple) -> Tuple:
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@_compiled
def _cross(a: Tuple, b: Tuple) -> Tuple:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@_compiled
def _triple(values: Array, start: int) -> Tuple:
    return (values[start], values[start + 1], values[start + 2])


@_compiled
def _quadruple(values: Array, start: int) -> Tuple:
    return (values[start], values[start + 1], values[start + 2], values[start + 3])


@_compiled
def _squared(a: Tuple, b: Tuple) -> float:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@_compiled
def _squared_angle(dot: float) -> float:
    angle = 2.0 * acos(min(abs(dot), 1.0))
    return angle * angle


@_compiled
def _dot(a: Tuple, b: Tuple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@_compiled
def _gravity_z(q: Tuple) -> float:
    return 2.0 * (q[1] * q[1] + q[2] * q[2]) - 1.0


@_compiled
def joint_targets(
    actions: Array, limit: float, lead: Array, rows: Array, default: Array, scale: Array,
    out_action: Array, out_target: Array, out_bad: Array,
) -> bool:  # fmt: skip
    """Turns (N, n) actions into standard actions and joint targets.

    ``lead`` is (T, n), what is added to an action for the row of the table, or (0, n). An action
    with a NaN or infinite entry is bad, and taken as zero. Returns whether any is.
    """
    some = False
    num, n = actions.shape
    for i in range(num):
        bad = False
        for j in range(n):
            if not np.isfinite(actions[i, j]):
                bad = True
        out_bad[i] = bad
        some |= bad
        for j in range(n):
            action = 0.0 if bad else min(max(actions[i, j], -limit), limit)
            if len(lead):
                action += lead[rows[i], j]
            out_action[i, j] = action
            out_target[i, j] = default[i, j] + scale[j] * action
    return some


@_compiled
def exploded(
    qpos: Array, qvel: Array, warnings: Array, kinds: Array, limit: float, out: Array
) -> bool:
    """Whether any simulation has a warning, a speed over the limit, or a NaN; (N,) which.

    ``warnings`` is (N, kinds, 2), with counts last.
    """
    some = False
    for i in range(len(qpos)):
        bad = False
        for w in kinds:
            if warnings[i, w, 1] != 0:
                bad = True
        for v in range(qvel.shape[1]):
            if not abs(qvel[i, v]) < limit:
                bad = True
        for q in range(qpos.shape[1]):
            if not np.isfinite(qpos[i, q]):
                bad = True
        out[i] = bad
        some |= bad
    return some


@_compiled
def place_bodies(tree: Tree, qpos: Array, qvel: Array, ids: Array, out: Bodies) -> None:
    """Forward kinematics of the tracked bodies of the simulations ``ids``."""
    num = len(tree.parent)
    frames, moves = np.empty((num, 7)), np.empty((num, 6))
    for i in ids:
        for k in range(num):
            p = tree.parent[k]
            if p < 0:
                x = _triple(qpos[i], 0)
                q = _quadruple(qpos[i], 3)
                length = sqrt(_dot(q, q))
                q = (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
                v = _triple(qvel[i], 0)
                w = _rotate(_matrix(q), _triple(qvel[i], 3))
            else:
                q = _quadruple(frames[p], 3)
                arm = _rotate(_matrix(q), tree.position[k])
                x = (frames[p, 0] + arm[0], frames[p, 1] + arm[1], frames[p, 2] + arm[2])
                q = _product(q, tree.quaternion[k])
                w = _triple(moves[p], 3)
                turn = _cross(w, arm)
                v = (moves[p, 0] + turn[0], moves[p, 1] + turn[1], moves[p, 2] + turn[2])
            for j in range(tree.first[k], tree.first[k + 1]):
                m = _matrix(q)
                speed = qvel[i, 6 + tree.joint[j]]
                half = 0.5 * (qpos[i, 7 + tree.joint[j]] - tree.zero[j])
                axis, s = tree.axis[j], sin(half)
                q = _product(q, (cos(half), s * axis[0], s * axis[1], s * axis[2]))
                a = _rotate(m, axis)
                # The anchor stays where it is; the origin turns about it.
                to, back = _rotate(m, tree.anchor[j]), _rotate(_matrix(q), tree.anchor[j])
                before = _cross(w, to)
                w = (w[0] + a[0] * speed, w[1] + a[1] * speed, w[2] + a[2] * speed)
                after = _cross(w, back)
                x = (x[0] + to[0] - back[0], x[1] + to[1] - back[1], x[2] + to[2] - back[2])
                v = (
                    v[0] + before[0] - after[0],
                    v[1] + before[1] - after[1],
                    v[2] + before[2] - after[2],
                )
            frames[k, 0], frames[k, 1], frames[k, 2] = x
            frames[k, 3], frames[k, 4], frames[k, 5], frames[k, 6] = q
            moves[k, 0], moves[k, 1], moves[k, 2] = v
            moves[k, 3], moves[k, 4], moves[k, 5] = w
            b = tree.slot[k]
            if b >= 0:
                for c in range(3):
                    out.position[i, b, c] = frames[k, c]
                    out.linear_velocity[i, b, c] = moves[k, c]
                    out.angular_velocity[i, b, c] = moves[k, 3 + c]
                for c in range(4):
                    out.quaternion[i, b, c] = frames[k, 3 + c]


@_compiled
def _contacts(history: Array, numbers: Numbers) -> int:
    """Bodies, or physics steps, with a contact force above the threshold.

    A sensor's row of the history is: user value, cursor, the samples' times, the samples.
    """
    samples = numbers.samples
    size = 2 + 4 * samples
    least = numbers.contact_force * numbers.contact_force
    sensors = len(history) // size
    outer, inner = (samples, sensors) if numbers.by_substep else (sensors, samples)
    count = 0
    for a in range(outer):
        for b in range(inner):
            sensor, sample = (b, a) if numbers.by_substep else (a, b)
            f = _triple(history, sensor * size + 2 + samples + 3 * sample)
            if f[0] * f[0] + f[1] * f[1] + f[2] * f[2] > least:
                count += 1
                break
    return count


@_compiled
def judge(
    numbers: Numbers, at: Columns, table: Array, rows: Array, qpos: Array, bodies: Bodies,
    action: Array, previous: Array, history: Array, object_active: bool, diverged: Array,
    out_figures: Array, out_flags: Array, out_reward: Array, out_terminated: Array,
) -> None:  # fmt: skip
    """Rewards and terminations: see ``rewards``, ``terminations`` and ``alignment``.

    Writes (terms + errors, N) weighted rewards and roots of the squared errors, (5, N) the four
    tests and whether the simulation diverged, in which case there is no reward, (N,) sums of the
    rewards and (N,) whether any flag is set.
    """
    count, a = bodies.position.shape[1], numbers.anchor
    limits, tracking = numbers.thresholds, len(numbers.columns)
    n = len(numbers.lower)
    e = np.zeros(8)
    oriented = 0
    for b in range(count):
        oriented += numbers.oriented[b]
    for i in range(len(rows)):
        r = table[rows[i]]
        p, q = bodies.position[i, a], bodies.quaternion[i, a]
        rp, rq = _triple(r, at.position + 3 * a), _quadruple(r, at.quaternion + 4 * a)
        e[:] = 0.0
        e[0] = _squared(p, rp)
        e[1] = _squared_angle(_dot(q, rq))
        d = _product(q, _conjugate(rq))
        half = 0.5 * atan2(
            2.0 * (d[0] * d[3] + d[1] * d[2]), 1.0 - 2.0 * (d[2] * d[2] + d[3] * d[3])
        )
        c, s = cos(half), sin(half)
        cosine, sine = c * c - s * s, 2.0 * c * s
        for b in range(count):
            # The reference's body, turned and moved to the robot's anchor but for its height.
            place = _triple(r, at.position + 3 * b)
            x, y = place[0] - rp[0], place[1] - rp[1]
            moved = (p[0] + cosine * x - sine * y, p[1] + sine * x + cosine * y, place[2])
            e[2] += _squared(bodies.position[i, b], moved)
            if numbers.oriented[b]:
                o, t = bodies.quaternion[i, b], _quadruple(r, at.quaternion + 4 * b)
                turned = o[3] * t[0] + o[2] * t[1] - o[1] * t[2] - o[0] * t[3]
                e[3] += _squared_angle(c * _dot(o, t) + s * turned)
            e[4] += _squared(bodies.linear_velocity[i, b], _triple(r, at.linear + 3 * b))
            e[5] += _squared(bodies.angular_velocity[i, b], _triple(r, at.angular + 3 * b))
        e[2] /= count
        e[3] /= oriented
        e[4] /= count
        e[5] /= count
        if numbers.has_object:
            pose = qpos[i, numbers.root_nq :]
            e[6] = _squared(pose, _triple(r, at.object_pose))
            e[7] = _squared_angle(_dot(pose[3:], _quadruple(r, at.object_pose + 3)))
        out_flags[0, i] = abs(p[2] - rp[2]) > limits[0]
        out_flags[1, i] = abs(_gravity_z(q) - _gravity_z(rq)) > limits[1]
        out_flags[2, i] = False
        for b in numbers.end_effectors:
            out_flags[2, i] |= (
                abs(bodies.position[i, b, 2] - r[at.position + 3 * b + 2]) > limits[2]
            )
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
            change += (action[i, j] - previous[i, j]) ** 2
            joint = qpos[i, 7 + j]
            excess += max(joint - numbers.upper[j], numbers.lower[j] - joint, 0.0)
        reward = 0.0
        penalties = (change, excess, float(_contacts(history[i], numbers)))
        for k in range(tracking + 3):
            if k < tracking:
                value = exp(e[numbers.columns[k]] * numbers.inverse_variance[k])
            else:
                value = penalties[k - tracking]
            term = 0.0 if diverged[i] else value * numbers.weights[k]
            out_figures[k, i] = term
            reward += term
        out_reward[i] = reward


@_compiled
def _write_rot6d(out: Array, start: int, m: Tuple) -> int:
    out[start], out[start + 1], out[start + 2] = m[0], m[1], m[3]
    out[start + 3], out[start + 4], out[start + 5] = m[4], m[6], m[7]
    return start + 6


@_compiled
def _write(out: Array, start: int, v: Tuple) -> int:
    for k in range(len(v)):
        out[start + k] = v[k]
    return start + len(v)


@_compiled
def _write_policy(
    out: Array, estimated: bool, row: Array, at: Columns, rp: Tuple, turn: Tuple,
    anchor_p: Tuple, anchor_m: Tuple, qpos: Array, qvel: Array, default: Array, action: Array,
) -> int:  # fmt: skip
    n = len(default)
    k = _write(out, 0, row[at.qpos + 7 : at.qpos + 7 + n])
    k = _write(out, k, row[at.qvel + 6 : at.qvel + 6 + n])
    if estimated:
        offset = (rp[0] - anchor_p[0], rp[1] - anchor_p[1], rp[2] - anchor_p[2])
        k = _write(out, k, _rotate_inverse(anchor_m, offset))
    k = _write_rot6d(out, k, turn)
    if estimated:
        base = _matrix(_quadruple(qpos, 3))
        k = _write(out, k, _rotate_inverse(base, _triple(qvel, 0)))
    k = _write(out, k, qvel[3:6])
    for j in range(n):
        out[k + j] = qpos[7 + j] - default[j]
        out[k + n + j] = qvel[6 + j]
        out[k + 2 * n + j] = action[j]
    return k + 3 * n


@_compiled
def observe(
    numbers: Numbers, at: Columns, table: Array, rows: Array, qpos: Array, qvel: Array,
    bodies: Bodies, default: Array, action: Array, noise: Array, ids: Array,
    out_policy: Array, out_critic: Array,
) -> None:  # fmt: skip
    """Observations of the simulations ``ids``: see ``observations``.

    ``noise`` is (K, W) uniform in [0, 1) or (0, 0); ``out_critic`` (N, size) or (0, 0).
    """
    a = numbers.anchor
    for place in range(len(ids)):
        i = ids[place]
        r, out = table[rows[i]], out_policy[i]
        rp, rq = _triple(r, at.position + 3 * a), _quadruple(r, at.quaternion + 4 * a)
        p, q = bodies.position[i, a], bodies.quaternion[i, a]
        back, m = _conjugate(q), _matrix(q)
        turn = _matrix(_product(back, rq))
        _write_policy(
            out, numbers.state_estimation, r, at, rp, turn, p, m, qpos[i], qvel[i], default[i],
            action[i],
        )  # fmt: skip
        if len(noise):
            for k in range(len(numbers.noise_width)):
                width = numbers.noise_width[k]
                out[numbers.noise_start + k] += (noise[place, k] - _HALF) * width
        if len(out_critic) == 0:
            continue
        out = out_critic[i]
        k = _write_policy(out, True, r, at, rp, turn, p, m, qpos[i], qvel[i], default[i], action[i])
        for b in range(bodies.position.shape[1]):
            x = bodies.position[i, b]
            k = _write(out, k, _rotate_inverse(m, (x[0] - p[0], x[1] - p[1], x[2] - p[2])))
        for b in range(bodies.position.shape[1]):
            k = _write_rot6d(out, k, _matrix(_product(back, bodies.quaternion[i, b])))
        if numbers.has_object:
            x = qpos[i, numbers.root_nq :]
            k = _write(out, k, _rotate_inverse(m, (x[0] - p[0], x[1] - p[1], x[2] - p[2])))
            k = _write_rot6d(out, k, _matrix(_product(back, _quadruple(x, 3))))
            k = _write(out, k, _rotate_inverse(m, _triple(qvel[i], numbers.root_nv)))


@_compiled
def advance(
    clocks: Clocks, terminated: Array, out_truncated: Array, out_done: Array
) -> tuple[bool, bool]:
    """Counts a control step and moves on to the next frames, the last ones staying.

    Writes (N,) which episodes are over for lack of motion or time alone, and which are over.
    Returns whether any is, and whether any push is due.
    """
    some, due = False, False
    for i in range(len(clocks.rows)):
        clocks.elapsed[i] += 1
        clocks.next_push[i] -= 1
        clocks.frame[i] = min(clocks.frame[i] + 1, clocks.last[i])
        clocks.rows[i] = clocks.first[i] + clocks.frame[i]
        over = clocks.elapsed[i] >= clocks.possible[i]
        out_truncated[i] = over and not terminated[i]
        out_done[i] = over or terminated[i]
        some |= out_done[i]
        due |= clocks.next_push[i] <= 0
    return some, due


@_compiled
def settle(
    numbers: Numbers, at: Columns, table: Array, tree: Tree, clocks: Clocks, qpos: Array,
    qvel: Array, default: Array, action: Array, previous: Array, history: Array,
    object_active: bool, diverged: Array, noise: Array, everyone: Array, out_bodies: Bodies,
    out_figures: Array, out_flags: Array, out_reward: Array, out_terminated: Array,
    out_truncated: Array, out_done: Array, out_policy: Array, out_critic: Array,
) -> tuple[bool, bool]:  # fmt: skip
    """All that follows a control step of physics, in one call: returns what ``advance`` does."""
    place_bodies(tree, qpos, qvel, everyone, out_bodies)
    judge(
        numbers, at, table, clocks.rows, qpos, out_bodies, action, previous, history,
        object_active, diverged, out_figures, out_flags, out_reward, out_terminated,
    )  # fmt: skip
    some, due = advance(clocks, out_terminated, out_truncated, out_done)
    observe(
        numbers, at, table, clocks.rows, qpos, qvel, out_bodies, default, action, noise, everyone,
        out_policy, out_critic,
    )  # fmt: skip
    return some, due


@_compiled
def start_states(
    numbers: Numbers, at: Columns, table: Array, rows: Array, draws: Array, ids: Array,
    out_qpos: Array, out_qvel: Array,
) -> None:  # fmt: skip
    """Puts the simulations ``ids`` on (K,) rows of the table, disturbed: see ``start_state``.

    ``draws`` is (K, 15 + n), root position, orientation, linear and angular velocity, object
    position and joints, or (0, 0).
    """
    n, nq, nv = len(numbers.lower), numbers.root_nq, numbers.root_nv
    for k in range(len(ids)):
        i, r = ids[k], table[rows[k]]
        qpos, qvel = out_qpos[i], out_qvel[i]
        _write(qpos, 0, r[at.qpos : at.qpos + nq])
        _write(qvel, 0, r[at.qvel : at.qvel + nv])
        if numbers.has_object:
            _write(qpos, nq, r[at.object_pose : at.object_pose + 7])
            _write(qvel, nv, r[at.object_velocity : at.object_velocity + 3])
            m = _matrix(_quadruple(r, at.object_pose + 3))
            _write(qvel, nv + 3, _rotate_inverse(m, _triple(r, at.object_velocity + 3)))
        if len(draws) == 0:
            continue
        d = draws[k]
        roll, pitch, yaw = 0.5 * d[3], 0.5 * d[4], 0.5 * d[5]
        about_z, about_y = (cos(yaw), 0.0, 0.0, sin(yaw)), (cos(pitch), 0.0, sin(pitch), 0.0)
        turn = _product(_product(about_z, about_y), (cos(roll), sin(roll), 0.0, 0.0))
        q = _quadruple(qpos, 3)
        turned = _product(turn, q)
        spin = _rotate(_matrix(q), _triple(qvel, 3))
        spin = (spin[0] + d[9], spin[1] + d[10], spin[2] + d[11])
        _write(qpos, 3, turned)
        _write(qvel, 3, _rotate_inverse(_matrix(turned), spin))
        for c in range(3):
            qpos[c] += d[c]
            qvel[c] += d[6 + c]
            if numbers.has_object:
                qpos[nq + c] += d[12 + c]
        for j in range(n):
            joint = qpos[7 + j] + d[15 + j]
            qpos[7 + j] = min(max(joint, numbers.lower[j]), numbers.upper[j])


@_compiled
def copy_rows(source: Array, index: Array, ids: Array, out: Array) -> None:
    """out[ids] = source[index] for (M, S) and (N, S) arrays."""
    for k in range(len(ids)):
        for c in range(source.shape[1]):
            out[ids[k], c] = source[index[k], c]
