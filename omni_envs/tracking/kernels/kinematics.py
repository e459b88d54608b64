"""Where the tracked bodies are."""

from __future__ import annotations

from math import sqrt

import numpy as np

from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.kernels.algebra import (
    cross,
    dot,
    matrix,
    product,
    quadruple,
    rotate,
    triple,
)
from omni_envs.tracking.kernels.compiled import Array, compiled
from omni_envs.tracking.kernels.plan import Tree
from omni_envs.tracking.kernels.sines import sines


@compiled
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
                x = triple(qpos, i, 0)
                q = quadruple(qpos, i, 3)
                length = sqrt(dot(q, q))
                q = (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
                m = matrix(q)
                v = triple(qvel, i, 0)
                w = rotate(m, triple(qvel, i, 3))
            else:
                x, q = triple(frames, p, 0), quadruple(frames, p, 3)
                m = (
                    frames[p, 7], frames[p, 8], frames[p, 9], frames[p, 10], frames[p, 11],
                    frames[p, 12], frames[p, 13], frames[p, 14], frames[p, 15],
                )  # fmt: skip
                v, w = triple(frames, p, 16), triple(frames, p, 19)
                arm = rotate(m, triple(tree.position, k, 0))
                turn = cross(w, arm)
                x = (x[0] + arm[0], x[1] + arm[1], x[2] + arm[2])
                v = (v[0] + turn[0], v[1] + turn[1], v[2] + turn[2])
                if tree.turned[k]:
                    q = product(q, quadruple(tree.quaternion, k, 0))
                    m = matrix(q)
            for j in range(tree.first[k], tree.first[k + 1]):
                if tree.aside[j]:
                    # The anchor stays where it is; the origin turns about it.
                    arm = rotate(m, triple(tree.anchor, j, 0))
                    turn = cross(w, arm)
                    x = (x[0] + arm[0], x[1] + arm[1], x[2] + arm[2])
                    v = (v[0] + turn[0], v[1] + turn[1], v[2] + turn[2])
                axis, s = triple(tree.axis, j, 0), sine[j]
                q = product(q, (cosine[j], s * axis[0], s * axis[1], s * axis[2]))
                m = matrix(q)
                a = rotate(m, axis)
                speed = qvel[i, 6 + tree.joint[j]]
                w = (w[0] + a[0] * speed, w[1] + a[1] * speed, w[2] + a[2] * speed)
                if tree.aside[j]:
                    arm = rotate(m, triple(tree.anchor, j, 0))
                    turn = cross(w, arm)
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
