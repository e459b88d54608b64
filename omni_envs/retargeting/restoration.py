"""Shortest steps onto the true constraints, which linearisation has left violated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omni_envs.retargeting import kernels
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, FOOTING, SELF, STANCE, BoundLimit, RowLimit, Rows
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.qp import StepQP, step_bounds, step_rows
from omni_envs.retargeting.softness import softness
from omni_envs.retargeting.solver import StepSolver

KINDS = (STANCE, SELF, CONTACT)  # as they are numbered
"""Kinds of rows in the order of ``result.RELAXATIONS``."""

# Longest step of a coordinate, m and rad: this many times the largest violation (m), within limits.
# Rows that contradict each other by a hair are met by absurd steps otherwise: two windows that want
# a flat foot 0.1 mm shorter turn it by 2°.
_REACH, _SHORTEST, _LONGEST = 30.0, 1e-3, 0.1
# Weight of the way of feet: a planted one moved now, be it within its window, is in the way of the
# next frame; a free one would land elsewhere.
_PLANTED = 30.0
_, _GIVES_WAY = softness(np.array(KINDS))


class Restored(NamedTuple):
    """Where the restoration stopped; the configuration is there.

    Attributes:
        steps: Quadratic programs solved.
        violations: Remaining violation of stance, self-collision and non-penetration, m.
        soft: Constraints had to give way in the last step.
    """

    steps: int
    violations: tuple[float, float, float]
    soft: bool


def row_violations(rows: Rows) -> tuple[float, float, float]:
    """Largest violation at dq = 0 by kind of constraint, m."""
    stance, own, contact, _ = kernels.worst_violations(*rows[1:], kinds=len(KINDS) + 1).tolist()
    return stance, own, contact


def restore(
    configuration: Kinematics,
    bounds: Sequence[BoundLimit],
    limits: Sequence[RowLimit],
    solver: StepSolver,
    options: RetargetOptions,
) -> Restored:
    """Moves a configuration onto its constraints by the shortest steps.

    Where they contradict each other they give way in their order. The best configuration on the way
    is kept.

    Args:
        configuration: Kinematics at the configuration; moves.
        bounds: Limits on single coordinates.
        limits: General limits.
        solver: Solver of a step.
        options: How many steps, and what needs none.
    """
    metric, soft, tolerance = configuration.metric, False, options.restoration_tolerance
    zero, kept, lowest = np.zeros(len(metric)), configuration.data.qpos.copy(), np.inf
    violations, merit = (0.0, 0.0, 0.0), np.inf
    for steps in range(options.restoration_iterations + 1):
        rows = step_rows(configuration, limits)
        found = row_violations(rows)
        merit = float(_GIVES_WAY @ np.maximum(np.subtract(found, tolerance), 0.0))
        if merit < lowest:
            kept, violations, lowest = configuration.data.qpos.copy(), found, merit
        worst = max(found)
        if worst <= tolerance or steps == options.restoration_iterations:
            break
        reach = min(max(_REACH * worst, _SHORTEST), _LONGEST)
        lower, upper = step_bounds(configuration, bounds)
        np.maximum(lower, -reach, out=lower)
        np.maximum(np.minimum(upper, reach), lower, out=upper)
        feet = rows.A[(rows.kind == STANCE) | (rows.kind == FOOTING)]
        H = np.diag(metric) + _PLANTED * (feet.T @ feet)
        dq, soft = solver(StepQP(H, zero, lower, upper, rows, metric, np.inf))
        configuration.update(configuration.step(dq))
    if merit > lowest:
        configuration.update(kept)
    return Restored(steps, violations, soft)
