"""What is read from, and written to, MuJoCo's simulations around a control step."""

from __future__ import annotations

import numpy as np
from numba import literal_unroll

from omni_envs.tracking.kernels.compiled import Array, compiled


@compiled
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


@compiled
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


@compiled
def choose_models(
    scenes: Array, motions: Array, count: int, draws: Array, out_model: Array
) -> None:
    """Draws (K,) of the ``count`` models of the ``scenes`` (M,) of motions, given uniform draws."""
    for k in range(len(motions)):
        out_model[k] = scenes[motions[k]] * count + int(draws[k] * count)


@compiled
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


@compiled
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
