"""The task compiled: for each simulation everything in one pass, without temporary arrays.

What is computed here is defined by the plain functions on arrays (``alignment``, ``rewards``,
``terminations``, ``observations``, ``randomization``); a test holds these loops to them. Numba
compiles on first use and keeps the result in its cache next to this file, or in the user's cache
directory where that cannot be written; its cache follows changes of a function's own file alone, so
all of this is one file. No fast mathematics: the same input gives the same bits.

Arrays named ``out`` are written to. ``rows`` are rows of ``MotionLibrary.table``, ``at`` are its
columns. What never changes comes as a ``Plan``: to hand over a tuple of arrays costs ten times as
much as an array, and a single environment would spend more on arguments than on arithmetic.
"""

from __future__ import annotations

from math import acos, atan2, cos, exp, floor, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import literal_unroll, njit

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.motion import Columns

Array = np.ndarray
Tuple = Any
"""A few numbers: a tuple or a row of an array."""

_compiled = njit(cache=True, nogil=True, error_model="numpy")

_QUARTERS, _QUARTER = 2.0 / pi, float.fromhex("0x1.921fb544p+0")
_QUARTER_REST = float.fromhex("0x1.0b4611a626331p-34")
"""Quarter turns per radian; a quarter turn, rad, whose multiples are exact, and its rest."""

NEVER = 2**62
"""Control steps until a push, or a time-out, that does not come."""


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
        turned: (K,) whether ``quaternion`` is not the identity.
        aside: (J,) whether ``anchor`` is not the origin.
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
    turned: Array
    aside: Array


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
        noise_width: (W,) widths of the noise from there on.
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
    """Where N episodes are: the rows of one (7, N) array; see ``Episodes``.

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


class Plan(NamedTuple):
    """``Numbers``, ``Columns`` and ``Tree`` in two arrays.

    Attributes:
        integers: Start and stop of every value, one after the other, then all that is counted,
            indexed or true.
        reals: All that is measured.
    """

    integers: Array
    reals: Array


def make_plan(numbers: Numbers, at: Columns, tree: Tree) -> Plan:
    """Packs what never changes; ``unpack`` knows the order."""
    values = [np.ravel(value) for value in (*numbers, *at, *tree)]
    real = [value.dtype.kind == "f" for value in values]
    ends = {True: 0, False: 2 * len(values)}
    places = []
    for value, kind in zip(values, real, strict=True):
        places += [ends[kind], ends[kind] + len(value)]
        ends[kind] += len(value)
    whole = [v.astype(np.int64) for v, kind in zip(values, real, strict=True) if not kind]
    parts = [v.astype(float) for v, kind in zip(values, real, strict=True) if kind]
    return Plan(np.concatenate([places, *whole]), np.concatenate(parts))


@_compiled
def _one(values: Array, integers: Array, k: int) -> Any:
    return values[integers[2 * k]]


@_compiled
def _all(values: Array, integers: Array, k: int) -> Array:
    return values[integers[2 * k] : integers[2 * k + 1]]


@_compiled
def _rows(values: Array, integers: Array, k: int, width: int) -> Array:
    part = _all(values, integers, k)
    return part.reshape(len(part) // width, width)


@_compiled
def unpack(i: Array, r: Array) -> tuple[Numbers, Columns, Tree]:
    """Undoes ``make_plan``, given its integers and reals, by views."""
    numbers = Numbers(
        _one(i, i, 0), _one(i, i, 1), _one(i, i, 2), _one(i, i, 3) != 0, _all(i, i, 4),
        _all(i, i, 5), _all(r, i, 6), _all(r, i, 7), _all(i, i, 8), _all(r, i, 9), _all(r, i, 10),
        _one(i, i, 11), _one(i, i, 12) != 0, _one(r, i, 13), _all(r, i, 14), _one(i, i, 15) != 0,
        _one(i, i, 16), _all(r, i, 17),
    )  # fmt: skip
    at = Columns(
        _one(i, i, 18), _one(i, i, 19), _one(i, i, 20), _one(i, i, 21), _one(i, i, 22),
        _one(i, i, 23), _one(i, i, 24), _one(i, i, 25),
    )  # fmt: skip
    tree = Tree(
        _all(i, i, 26), _all(i, i, 27), _rows(r, i, 28, 3), _rows(r, i, 29, 4), _all(i, i, 30),
        _rows(r, i, 31, 3), _rows(r, i, 32, 3), _all(r, i, 33), _all(i, i, 34), _all(i, i, 35),
        _all(i, i, 36),
    )  # fmt: skip
    return numbers, at, tree


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
def _triple(values: Array, i: int, start: int) -> Tuple:
    return (values[i, start], values[i, start + 1], values[i, start + 2])


@_compiled
def _quadruple(values: Array, i: int, start: int) -> Tuple:
    return (values[i, start], values[i, start + 1], values[i, start + 2], values[i, start + 3])


@_compiled
def _vector(values: Array, i: int, b: int) -> Tuple:
    return (values[i, b, 0], values[i, b, 1], values[i, b, 2])


@_compiled
def _turn(values: Array, i: int, b: int) -> Tuple:
    return (values[i, b, 0], values[i, b, 1], values[i, b, 2], values[i, b, 3])


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
def sines(angles: Array, out_sine: Array, out_cosine: Array) -> None:
    """Sines and cosines to 2e-16, for angles up to a million: unlike calls, it is done in vectors.

    An angle is a multiple of a quarter turn and a rest within ± an eighth, for which Taylor's
    series are short.
    """
    for k in range(len(angles)):
        quarters = floor(angles[k] * _QUARTERS + 0.5)
        x = (angles[k] - quarters * _QUARTER) - quarters * _QUARTER_REST
        z = x * x
        s = z / 355687428096000 - 1 / 1307674368000
        s = z * s + 1 / 6227020800
        s = z * s - 1 / 39916800
        s = z * s + 1 / 362880
        s = z * s - 1 / 5040
        s = z * s + 1 / 120
        s = x + x * z * (z * s - 1 / 6)
        c = z / 20922789888000 - 1 / 87178291200
        c = z * c + 1 / 479001600
        c = z * c - 1 / 3628800
        c = z * c + 1 / 40320
        c = z * c - 1 / 720
        c = z * c + 1 / 24
        c = 1 + z * (z * c - 1 / 2)
        odd = quarters - 2.0 * floor(0.5 * quarters)
        half = 0.5 * (quarters - odd)
        sign = 1.0 - 2.0 * (half - 2.0 * floor(0.5 * half))
        out_sine[k] = sign * (odd * c + (1.0 - odd) * s)
        out_cosine[k] = sign * ((1.0 - odd) * c - odd * s)


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
    num, hinges = len(tree.parent), len(tree.joint)
    # Position, quaternion, rotation matrix, linear and angular velocity.
    frames = np.empty((num, 22))
    half, sine, cosine = np.empty(hinges), np.empty(hinges), np.empty(hinges)
    for i in ids:
        for j in range(hinges):
            half[j] = 0.5 * (qpos[i, 7 + tree.joint[j]] - tree.zero[j])
        sines(half, sine, cosine)
        for k in range(num):
            p = tree.parent[k]
            if p < 0:
                x = _triple(qpos, i, 0)
                q = _quadruple(qpos, i, 3)
                length = sqrt(_dot(q, q))
                q = (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
                m = _matrix(q)
                v = _triple(qvel, i, 0)
                w = _rotate(m, _triple(qvel, i, 3))
            else:
                x, q = _triple(frames, p, 0), _quadruple(frames, p, 3)
                m = (
                    frames[p, 7], frames[p, 8], frames[p, 9], frames[p, 10], frames[p, 11],
                    frames[p, 12], frames[p, 13], frames[p, 14], frames[p, 15],
                )  # fmt: skip
                v, w = _triple(frames, p, 16), _triple(frames, p, 19)
                arm = _rotate(m, _triple(tree.position, k, 0))
                turn = _cross(w, arm)
                x = (x[0] + arm[0], x[1] + arm[1], x[2] + arm[2])
                v = (v[0] + turn[0], v[1] + turn[1], v[2] + turn[2])
                if tree.turned[k]:
                    q = _product(q, _quadruple(tree.quaternion, k, 0))
                    m = _matrix(q)
            for j in range(tree.first[k], tree.first[k + 1]):
                if tree.aside[j]:
                    # The anchor stays where it is; the origin turns about it.
                    arm = _rotate(m, _triple(tree.anchor, j, 0))
                    turn = _cross(w, arm)
                    x = (x[0] + arm[0], x[1] + arm[1], x[2] + arm[2])
                    v = (v[0] + turn[0], v[1] + turn[1], v[2] + turn[2])
                axis, s = _triple(tree.axis, j, 0), sine[j]
                q = _product(q, (cosine[j], s * axis[0], s * axis[1], s * axis[2]))
                m = _matrix(q)
                a = _rotate(m, axis)
                speed = qvel[i, 6 + tree.joint[j]]
                w = (w[0] + a[0] * speed, w[1] + a[1] * speed, w[2] + a[2] * speed)
                if tree.aside[j]:
                    arm = _rotate(m, _triple(tree.anchor, j, 0))
                    turn = _cross(w, arm)
                    x = (x[0] - arm[0], x[1] - arm[1], x[2] - arm[2])
                    v = (v[0] - turn[0], v[1] - turn[1], v[2] - turn[2])
            frames[k, 0], frames[k, 1], frames[k, 2] = x
            frames[k, 3], frames[k, 4], frames[k, 5], frames[k, 6] = q
            for c in range(9):
                frames[k, 7 + c] = m[c]
            frames[k, 16], frames[k, 17], frames[k, 18] = v
            frames[k, 19], frames[k, 20], frames[k, 21] = w
            b = tree.slot[k]
            if b >= 0:
                for c in range(3):
                    out.position[i, b, c] = x[c]
                    out.linear_velocity[i, b, c] = v[c]
                    out.angular_velocity[i, b, c] = w[c]
                for c in range(4):
                    out.quaternion[i, b, c] = q[c]


@_compiled
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
            f = _triple(history, i, sensor * size + 2 + samples + 3 * sample)
            if f[0] * f[0] + f[1] * f[1] + f[2] * f[2] > least:
                count += 1
                break
    return count


@_compiled
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
        p, q = _vector(position, i, a), _turn(turns, i, a)
        rp = _triple(table, r, at.position + 3 * a)
        rq = _quadruple(table, r, at.quaternion + 4 * a)
        e[0] = _squared(p, rp)
        e[1] = _squared_angle(_dot(q, rq))
        d = _product(q, _conjugate(rq))
        half = 0.5 * atan2(
            2.0 * (d[0] * d[3] + d[1] * d[2]), 1.0 - 2.0 * (d[2] * d[2] + d[3] * d[3])
        )
        c, s = cos(half), sin(half)
        cosine, sine = c * c - s * s, 2.0 * c * s
        place_error, angle_error, linear_error, angular_error = 0.0, 0.0, 0.0, 0.0
        for b in range(count):
            # The reference's body, turned and moved to the robot's anchor but for its height.
            place = _triple(table, r, at.position + 3 * b)
            x, y = place[0] - rp[0], place[1] - rp[1]
            moved = (p[0] + cosine * x - sine * y, p[1] + sine * x + cosine * y, place[2])
            place_error += _squared(_vector(position, i, b), moved)
            if numbers.oriented[b]:
                o, t = _turn(turns, i, b), _quadruple(table, r, at.quaternion + 4 * b)
                turned = o[3] * t[0] + o[2] * t[1] - o[1] * t[2] - o[0] * t[3]
                angle_error += _squared_angle(c * _dot(o, t) + s * turned)
            linear = _vector(bodies.linear_velocity, i, b)
            linear_error += _squared(linear, _triple(table, r, at.linear + 3 * b))
            angular = _vector(bodies.angular_velocity, i, b)
            angular_error += _squared(angular, _triple(table, r, at.angular + 3 * b))
        e[2] = place_error / count
        e[3] = angle_error / oriented
        e[4] = linear_error / count
        e[5] = angular_error / count
        if numbers.has_object:
            e[6] = _squared(_triple(qpos, i, nq), _triple(table, r, at.object_pose))
            e[7] = _squared_angle(
                _dot(_quadruple(qpos, i, nq + 3), _quadruple(table, r, at.object_pose + 3))
            )
        out_flags[0, i] = abs(p[2] - rp[2]) > limits[0]
        out_flags[1, i] = abs(_gravity_z(q) - _gravity_z(rq)) > limits[1]
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


@_compiled
def uniform(seed: int, k: int) -> float:
    """The k-th number in [0, 1) of a stream of chance: SplitMix64's scrambling of a counter."""
    z = np.uint64(seed) + np.uint64(k + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.float64((z ^ (z >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53


@_compiled
def _write_rot6d(out: Array, i: int, start: int, m: Tuple) -> int:
    out[i, start], out[i, start + 1], out[i, start + 2] = m[0], m[1], m[3]
    out[i, start + 3], out[i, start + 4], out[i, start + 5] = m[4], m[6], m[7]
    return start + 6


@_compiled
def _write(out: Array, i: int, start: int, v: Tuple) -> int:
    for k in range(len(v)):
        out[i, start + k] = v[k]
    return start + len(v)


@_compiled
def _copy(out: Array, i: int, start: int, source: Array, row: int, first: int, count: int) -> int:
    for k in range(count):
        out[i, start + k] = source[row, first + k]
    return start + count


@_compiled
def _write_policy(
    out: Array, i: int, estimated: bool, table: Array, row: int, at: Columns, rp: Tuple,
    turn: Tuple, anchor_p: Tuple, anchor_m: Tuple, qpos: Array, qvel: Array, default: Array,
    action: Array,
) -> int:  # fmt: skip
    n = default.shape[1]
    k = _copy(out, i, 0, table, row, at.qpos + 7, n)
    k = _copy(out, i, k, table, row, at.qvel + 6, n)
    if estimated:
        offset = (rp[0] - anchor_p[0], rp[1] - anchor_p[1], rp[2] - anchor_p[2])
        k = _write(out, i, k, _rotate_inverse(anchor_m, offset))
    k = _write_rot6d(out, i, k, turn)
    if estimated:
        base = _matrix(_quadruple(qpos, i, 3))
        k = _write(out, i, k, _rotate_inverse(base, _triple(qvel, i, 0)))
    k = _write(out, i, k, _triple(qvel, i, 3))
    for j in range(n):
        out[i, k + j] = qpos[i, 7 + j] - default[i, j]
        out[i, k + n + j] = qvel[i, 6 + j]
        out[i, k + 2 * n + j] = action[i, j]
    return k + 3 * n


@_compiled
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
        rp = _triple(table, r, at.position + 3 * a)
        rq = _quadruple(table, r, at.quaternion + 4 * a)
        p, q = _vector(position, i, a), _turn(turns, i, a)
        back, m = _conjugate(q), _matrix(q)
        turn = _matrix(_product(back, rq))
        _write_policy(
            out_policy, i, estimated, table, r, at, rp, turn, p, m, qpos, qvel, default, action
        )
        for k in range(noisy):
            noise[k] = uniform(seed, i * noisy + k) - 0.5
        for k in range(noisy):
            out_policy[i, numbers.noise_start + k] += share * noise[k] * numbers.noise_width[k]
        if len(out_critic) == 0:
            continue
        k = _write_policy(
            out_critic, i, True, table, r, at, rp, turn, p, m, qpos, qvel, default, action
        )
        for b in range(position.shape[1]):
            x = _vector(position, i, b)
            offset = (x[0] - p[0], x[1] - p[1], x[2] - p[2])
            k = _write(out_critic, i, k, _rotate_inverse(m, offset))
        for b in range(position.shape[1]):
            k = _write_rot6d(out_critic, i, k, _matrix(_product(back, _turn(turns, i, b))))
        if numbers.has_object:
            x = _triple(qpos, i, nq)
            offset = (x[0] - p[0], x[1] - p[1], x[2] - p[2])
            k = _write(out_critic, i, k, _rotate_inverse(m, offset))
            turn = _matrix(_product(back, _quadruple(qpos, i, nq + 3)))
            k = _write_rot6d(out_critic, i, k, turn)
            _write(out_critic, i, k, _rotate_inverse(m, _triple(qvel, i, numbers.root_nv)))


@_compiled
def _clocks(c: Array) -> Clocks:
    return Clocks(c[0], c[1], c[2], c[3], c[4], c[5], c[6])


@_compiled
def advance(
    clocks: Clocks, terminated: Array, ids: Array, out_truncated: Array, out_done: Array
) -> tuple[bool, bool]:
    """Counts a control step of the simulations ``ids`` and moves on to the next frames.

    The last frame of a motion stays. Writes (N,) which episodes are over for lack of motion or time
    alone, and which are over. Returns whether any is, and whether any push is due.
    """
    some, due = False, False
    for i in ids:
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
    integers: Array, reals: Array, table: Array, clocks: Array, qpos: Array, qvel: Array,
    position: Array, quaternion: Array, linear: Array, angular: Array, default: Array,
    action: Array, previous: Array, history: Array, object_active: bool, diverged: Array,
    seed: int, share: float, ids: Array, out_figures: Array, out_flags: Array, out_reward: Array,
    out_policy: Array, out_critic: Array,
) -> tuple[bool, bool]:  # fmt: skip
    """All that follows a control step of physics: bodies, ``judge``, ``advance``, ``observe``.

    ``out_flags`` is (8, N): those of ``judge``, whether any is set, and the two of ``advance``,
    whose result is returned.
    """
    numbers, at, tree = unpack(integers, reals)
    bodies = Bodies(position, quaternion, linear, angular)
    now = _clocks(clocks)
    place_bodies(tree, qpos, qvel, ids, bodies)
    judge(
        numbers, at, table, now.rows, qpos, bodies, action, previous, history, object_active,
        diverged, ids, out_figures, out_flags, out_reward, out_flags[5],
    )  # fmt: skip
    some, due = advance(now, out_flags[5], ids, out_flags[6], out_flags[7])
    observe(
        numbers, at, table, now.rows, qpos, qvel, bodies, default, action, seed, share, ids,
        out_policy, out_critic,
    )  # fmt: skip
    return some, due


@_compiled
def look(
    integers: Array, reals: Array, table: Array, clocks: Array, qpos: Array, qvel: Array,
    position: Array, quaternion: Array, linear: Array, angular: Array, default: Array,
    action: Array, seed: int, share: float, ids: Array, out_policy: Array, out_critic: Array,
) -> None:  # fmt: skip
    """Observes the simulations ``ids``, whose bodies are where they were: see ``observe``."""
    numbers, at, _ = unpack(integers, reals)
    observe(
        numbers, at, table, _clocks(clocks).rows, qpos, qvel,
        Bodies(position, quaternion, linear, angular), default, action, seed, share, ids,
        out_policy, out_critic,
    )  # fmt: skip


@_compiled
def begin(
    integers: Array, reals: Array, table: Array, clocks: Array, qpos: Array, qvel: Array,
    position: Array, quaternion: Array, linear: Array, angular: Array, default: Array,
    action: Array, seed: int, share: float, ids: Array, out_policy: Array, out_critic: Array,
    draws: Array, widths: Array,
) -> None:  # fmt: skip
    """Puts the simulations ``ids`` into start states, and observes them: see ``start_states``.

    They start a frame before the one to track first.
    """
    numbers, at, tree = unpack(integers, reals)
    bodies = Bodies(position, quaternion, linear, angular)
    rows = _clocks(clocks).rows
    start_states(numbers, at, table, rows, draws, widths, ids, qpos, qvel)
    place_bodies(tree, qpos, qvel, ids, bodies)
    observe(
        numbers, at, table, rows, qpos, qvel, bodies, default, action, seed, share, ids,
        out_policy, out_critic,
    )  # fmt: skip


@_compiled
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


@_compiled
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
    now = _clocks(clocks)
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


@_compiled
def next_push(pushes: Array, draw: float) -> int:
    """Control steps until a push; see ``start_clocks``."""
    if len(pushes) == 0:
        return NEVER
    return max(int(np.rint(pushes[0] + (pushes[1] - pushes[0]) * draw)), 1)


@_compiled
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
        _copy(out_qpos, i, 0, table, r, at.qpos, nq)
        _copy(out_qvel, i, 0, table, r, at.qvel, nv)
        if numbers.has_object:
            _copy(out_qpos, i, nq, table, r, at.object_pose, 7)
            _copy(out_qvel, i, nv, table, r, at.object_velocity, 3)
            m = _matrix(_quadruple(table, r, at.object_pose + 3))
            spin = _rotate_inverse(m, _triple(table, r, at.object_velocity + 3))
            _write(out_qvel, i, nv + 3, spin)
        if len(widths) == 0:
            continue
        wide = min(k, len(widths) - 1)
        for c in range(15 + n):
            d[c] = (2.0 * draws[c, k] - 1.0) * widths[wide, c]
        roll, pitch, yaw = 0.5 * d[3], 0.5 * d[4], 0.5 * d[5]
        about_z, about_y = (cos(yaw), 0.0, 0.0, sin(yaw)), (cos(pitch), 0.0, sin(pitch), 0.0)
        turn = _product(_product(about_z, about_y), (cos(roll), sin(roll), 0.0, 0.0))
        q = _quadruple(out_qpos, i, 3)
        turned = _product(turn, q)
        spin = _rotate(_matrix(q), _triple(out_qvel, i, 3))
        spin = (spin[0] + d[9], spin[1] + d[10], spin[2] + d[11])
        _write(out_qpos, i, 3, turned)
        _write(out_qvel, i, 3, _rotate_inverse(_matrix(turned), spin))
        for c in range(3):
            out_qpos[i, c] += d[c]
            out_qvel[i, c] += d[6 + c]
            if numbers.has_object:
                out_qpos[i, nq + c] += d[12 + c]
        for j in range(n):
            joint = out_qpos[i, 7 + j] + d[15 + j]
            out_qpos[i, 7 + j] = min(max(joint, numbers.lower[j]), numbers.upper[j])


@_compiled
def choose_models(
    scenes: Array, motions: Array, count: int, draws: Array, out_model: Array
) -> None:
    """Draws (K,) of the ``count`` models of the ``scenes`` (M,) of motions, given uniform draws."""
    for k in range(len(motions)):
        out_model[k] = scenes[motions[k]] * count + int(draws[k] * count)


@_compiled
def exchange_models(
    source: Array, models: Array, ids: Array, out: tuple[Array, ...], out_model: Array,
    out_warmstart: Array,
) -> None:  # fmt: skip
    """Gives the simulations ``ids`` the (K,) models, and nothing to start the solver from.

    out[…][ids] = source[models], for (M, S) numbers and (N, …) parts of S together.
    """
    for k in range(len(ids)):
        start, i, model = 0, ids[k], models[k]
        for part in literal_unroll(out):
            for c in range(part.shape[1]):
                part[i, c] = source[model, start + c]
            start += part.shape[1]
        out_model[i] = model
        out_warmstart[i, :] = 0.0


@_compiled
def copy_states(
    qpos: Array, qvel: Array, warmstart: Array, out_qpos: Array, out_qvel: Array,
    out_warmstart: Array,
) -> None:  # fmt: skip
    """Copies all of them, simulation by simulation."""
    for i in range(len(qpos)):
        for c in range(qpos.shape[1]):
            out_qpos[i, c] = qpos[i, c]
        for c in range(qvel.shape[1]):
            out_qvel[i, c] = qvel[i, c]
            out_warmstart[i, c] = warmstart[i, c]
