"""What the loops are told in few arrays: the robot's tree, numbers of the configuration, clocks.

To hand over a tuple of arrays costs ten times as much as an array, and a single environment would
spend more on arguments than on arithmetic: what never changes comes as a ``Plan``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omni_envs.tracking.kernels.compiled import Array, compiled
from omni_envs.tracking.motion import Columns


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


@compiled
def _matrix(values: Array, width: int) -> Array:
    return values.reshape(len(values) // width, width)


@compiled
def unpack(i: Array, r: Array) -> tuple[Numbers, Columns, Tree]:
    """Undoes ``make_plan``, given its integers and reals, by views.

    The k-th value goes from i[2 k] to i[2 k + 1]. Written out: functions that take such a number
    would be compiled anew for each.
    """
    numbers = Numbers(
        i[i[0]], i[i[2]], i[i[4]], i[i[6]] != 0, i[i[8] : i[9]], i[i[10] : i[11]],
        r[i[12] : i[13]], r[i[14] : i[15]], i[i[16] : i[17]], r[i[18] : i[19]], r[i[20] : i[21]],
        i[i[22]], i[i[24]] != 0, r[i[26]], r[i[28] : i[29]], i[i[30]] != 0, i[i[32]],
        r[i[34] : i[35]],
    )  # fmt: skip
    at = Columns(
        i[i[36]], i[i[38]], i[i[40]], i[i[42]], i[i[44]], i[i[46]], i[i[48]], i[i[50]],
    )  # fmt: skip
    tree = Tree(
        i[i[52] : i[53]], i[i[54] : i[55]], _matrix(r[i[56] : i[57]], 3),
        _matrix(r[i[58] : i[59]], 4), i[i[60] : i[61]], _matrix(r[i[62] : i[63]], 3),
        _matrix(r[i[64] : i[65]], 3), r[i[66] : i[67]], i[i[68] : i[69]], i[i[70] : i[71]],
        i[i[72] : i[73]],
    )  # fmt: skip
    return numbers, at, tree


@compiled
def clock_rows(c: Array) -> Clocks:
    """The rows of a (7, N) array by name."""
    return Clocks(c[0], c[1], c[2], c[3], c[4], c[5], c[6])
