"""One frame: sequential quadratic programming, then restoration on true distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import BoundLimit, RowLimit
from omni_envs.retargeting.options import RetargetOptions
from omni_envs.retargeting.qp import StepQP, step_bounds, step_model, step_rows
from omni_envs.retargeting.restoration import restore as restore_constraints
from omni_envs.retargeting.restoration import row_violations
from omni_envs.retargeting.solver import StepSolver
from omni_envs.retargeting.tasks import CostTask

_DEEP = 5e-3  # m
_EXACT = 0.2  # of the convergence: error of a prediction that leaves nothing to a further step


@dataclass(frozen=True)
class FrameResult:
    """A solved frame.

    Attributes:
        q: (nq,) configuration.
        iterations: Quadratic programs solved.
        violations: Remaining violation of stance, self-collision and non-penetration, m.
        soft: Constraints had to give way in the last step.
    """

    q: np.ndarray
    iterations: int
    violations: tuple[float, float, float]
    soft: bool


class FrameSolver:
    """Solves single frames with a fixed set of tasks and limits.

    Args:
        configuration: Kinematics that tasks and limits are evaluated on.
        tasks: What is minimised.
        bounds: Limits on dq.
        rows: Limits on linear combinations of dq.
        solver: Solver of a step.
        options: Settings.
    """

    def __init__(
        self,
        configuration: Kinematics,
        tasks: list[CostTask],
        bounds: list[BoundLimit],
        rows: list[RowLimit],
        solver: StepSolver,
        options: RetargetOptions,
    ) -> None:
        self.configuration = configuration
        self.tasks = tasks
        self.bounds = bounds
        self.row_limits = rows
        self.solver = solver
        self.options = options

    def cost(self) -> float:
        """Value of all tasks where the configuration is."""
        return step_model(self.configuration, self.tasks)[2]

    def solve(
        self,
        q: np.ndarray,
        iterations: int,
        radius: float,
        convergence: float,
        fallback: np.ndarray | None = None,
        restore: bool = True,
    ) -> FrameResult:
        """Minimises the tasks from a starting configuration, then restores feasibility.

        Args:
            q: (nq,) start.
            iterations: Most steps.
            radius: Trust region of a step.
            convergence: Stop when the predicted cost changes relatively less.
            fallback: (nq,) where to start instead, if the start is deep inside something: from
                there the way out may be on the wrong side.
            restore: Restore feasibility on true distances; without, violations are not known (0).
        """
        configuration, soft, steps = self.configuration, False, 0
        configuration.update(q)
        predicted, inside, before_that = np.inf, False, np.zeros(configuration.model.nv)
        while steps < iterations:
            H, g, before = step_model(configuration, self.tasks)
            if inside and abs(before - predicted) <= _EXACT * convergence * abs(predicted):
                break
            lower, upper = step_bounds(configuration, self.bounds)
            rows = step_rows(configuration, self.row_limits)
            if fallback is not None and max(row_violations(rows)[1:]) > _DEEP:
                configuration.update(fallback)
                fallback = None
                continue
            fallback = None
            qp = StepQP(H, g, lower, upper, rows, configuration.metric, radius)
            dq, soft = self.solver(qp)
            configuration.update(configuration.step(dq))
            steps += 1
            change, norm = qp.decrease(dq), qp.norm(dq)
            inside = not soft and norm < 0.99 * radius
            if qp.metric @ (dq * before_that) < -0.5 * norm * qp.norm(before_that):
                radius = 0.5 * norm  # it undid the step before that: no cycles
            before_that = 0.0 * dq if soft else dq
            last, predicted = predicted, before + change
            small = min(abs(change), abs(predicted - last))
            if not soft and small <= convergence * abs(predicted):
                break
        if not restore:
            return FrameResult(configuration.data.qpos.copy(), steps, (0.0, 0.0, 0.0), soft)
        repairs, violations, repair_soft = restore_constraints(
            configuration, self.bounds, self.row_limits, self.solver, self.options
        )
        q = configuration.data.qpos.copy()
        return FrameResult(q, steps + repairs, violations, soft or repair_soft)
