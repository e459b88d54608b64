"""A second backend to check the first with: pinocchio's kinematics and placo's QP.

Contact points and normals are MuJoCo's, as placo knows neither object nor ground; where the robot's
points are and how they move is pinocchio's, from a URDF written off the description. Slow, and
without second-order cone: the trust region is found as for DAQP.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from types import ModuleType
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from omni_envs.errors import MissingDependencyError
from omni_envs.retargeting.interaction_mesh import rotation_matrices
from omni_envs.retargeting.kinematics import Kinematics, Points
from omni_envs.retargeting.qp import StepQP
from omni_envs.retargeting.softness import softness
from omni_envs.retargeting.solver import solve_on_cone
from omni_envs.robots import Robot
from omni_envs.scenes import Scene


class PlacoKinematics(Kinematics):
    """Kinematics whose points and Jacobians are pinocchio's.

    Args:
        robot: The robot.
        scene: Its surroundings.
        contact_distance: See ``Kinematics``.
        self_distance: See ``Kinematics``.

    Raises:
        MissingDependencyError: placo is not installed.
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        contact_distance: float = 0.05,
        self_distance: float | None = 0.02,
    ) -> None:
        placo = _placo()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "robot.urdf"
            path.write_text(robot_urdf(robot), encoding="utf-8")
            self._other = placo.RobotWrapper(str(path), placo.Flags.ignore_collisions)
        self._columns = [self._other.get_joint_v_offset(joint) for joint in robot.joint_names]
        super().__init__(robot, scene, contact_distance, self_distance)

    def update(self, q: np.ndarray | None = None) -> None:
        """Moves to the (nq,) configuration q, in both libraries."""
        super().update(q)
        q = self.data.qpos
        base = np.eye(4)
        base[:3, :3], base[:3, 3] = rotation_matrices(q[3:7]), q[:3]
        self._other.set_T_world_fbase(base)
        for joint, value in zip(self.robot.joint_names, q[7:], strict=True):
            self._other.set_joint(joint, float(value))
        self._other.update_kinematics()
        self._base = base[:3, :3]

    def positions(self, points: Points) -> np.ndarray:
        """(K, 3) world positions of points."""
        poses = {int(b): self._pose(int(b)) for b in np.unique(points.bodies)}
        return np.array(
            [
                poses[int(body)][:3, :3] @ offset + poses[int(body)][:3, 3]
                for body, offset in zip(points.bodies, points.offsets, strict=True)
            ]
        ).reshape(-1, 3)

    def body_jacobians(self, bodies: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """(3, K, nv) Jacobians of (K, 3) world points that move with (K,) bodies."""
        jacobian = np.zeros((3, len(bodies), self.model.nv))
        for k, (body, position) in enumerate(zip(bodies.tolist(), positions, strict=True)):
            if not self.ancestors[body].any():
                continue
            name = self.model.body(body).name
            frame = np.array(self._other.frame_jacobian(name, "local_world_aligned"))
            x, y, z = position - self._pose(body)[:3, 3]
            arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            moved = frame[:3] - arm @ frame[3:]
            # pinocchio's base twist is local; MuJoCo's linear part is the world's.
            jacobian[:, k, :3] = moved[:, :3] @ self._base.T
            jacobian[:, k, 3:6] = moved[:, 3:6]
            jacobian[:, k, 6:] = moved[:, self._columns]
        return jacobian

    def contact_rows(
        self, bodies: np.ndarray, points: np.ndarray, normals: np.ndarray
    ) -> np.ndarray:
        """(N, nv) rows n·(J₂ - J₁) of contacts; see ``Kinematics``."""
        relative = self.body_jacobians(bodies[:, 1], points)
        relative -= self.body_jacobians(bodies[:, 0], points)
        return np.einsum("nd,dnv->nv", normals, relative)

    def _pose(self, body: int) -> np.ndarray:
        return np.array(self._other.get_T_world_frame(self.model.body(body).name))


def solve_placo(qp: StepQP) -> tuple[np.ndarray, bool]:
    """Solves a step with placo's QP solver. Never fails: see ``solver.solve_daqp``."""
    return solve_on_cone(qp, _solve_hard, _solve_soft)


def _solve_hard(qp: StepQP, damping: float) -> np.ndarray | None:
    return _solve(qp, damping, soft=False)


def _solve_soft(qp: StepQP, damping: float) -> np.ndarray:
    dq = _solve(qp, damping, soft=True)
    return np.zeros(len(qp.g)) if dq is None else dq


def _solve(qp: StepQP, damping: float, soft: bool) -> np.ndarray | None:
    placo = _placo()
    problem = placo.Problem()
    problem.regularization = 0.0
    n = len(qp.g)
    x = problem.add_variable(n).expr()
    # ½ dqᵀH dq + gᵀdq = ½ ‖F dq + F⁻ᵀ g‖² + constant, with FᵀF = H.
    H = qp.H + damping * np.diag(qp.metric)
    F = np.linalg.cholesky(H).T
    task = x.left_multiply(F) == -np.linalg.solve(F.T, qp.g)
    problem.add_constraint(task).configure("soft", 1.0)
    weights, _ = softness(qp.rows.kind)

    def add(A: np.ndarray, bound: np.ndarray, weight: np.ndarray | None) -> None:
        finite = np.isfinite(bound)
        if weight is None:
            if finite.any():
                constraint = x.left_multiply(A[finite]) <= bound[finite]
                problem.add_constraint(constraint).configure("hard", 1.0)
            return
        for i in np.flatnonzero(finite):
            constraint = x.left_multiply(A[i : i + 1]) <= bound[i : i + 1]
            problem.add_constraint(constraint).configure("soft", float(weights[i]))

    eye = np.eye(n)
    add(eye, qp.upper, None)
    add(-eye, -qp.lower, None)
    add(qp.rows.A, qp.rows.upper, weights if soft else None)
    add(-qp.rows.A, -qp.rows.lower, weights if soft else None)
    try:
        problem.solve()
    except RuntimeError:  # what placo raises on an infeasible program
        return None
    return np.minimum(np.maximum(np.array(problem.x[:n]), qp.lower), qp.upper)


def robot_urdf(robot: Robot) -> str:
    """The kinematic tree of a robot as URDF: links are named after bodies."""
    model = robot.model
    lines = [f'<robot name="{robot.name}">']
    lines += [f"<link name={quoteattr(name)}/>" for name in robot.body_names]
    for joint in robot.joint_names:
        index = model.joint(joint).id
        body = int(model.jnt_bodyid[index])
        euler = np.zeros(3)
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.body_quat[body])
        R = rotation.reshape(3, 3)
        euler[:] = (
            np.arctan2(R[2, 1], R[2, 2]),
            np.arctan2(-R[2, 0], np.hypot(R[2, 1], R[2, 2])),
            np.arctan2(R[1, 0], R[0, 0]),
        )
        low, high = model.jnt_range[index]
        lines.append(
            f'<joint name={quoteattr(joint)} type="revolute">'
            f'<origin xyz="{_text(model.body_pos[body])}" rpy="{_text(euler)}"/>'
            f"<parent link={quoteattr(model.body(int(model.body_parentid[body])).name)}/>"
            f"<child link={quoteattr(model.body(body).name)}/>"
            f'<axis xyz="{_text(model.jnt_axis[index])}"/>'
            f'<limit lower="{low:.17g}" upper="{high:.17g}" effort="1" velocity="1"/></joint>'
        )
    return "\n".join([*lines, "</robot>"])


def _text(values: np.ndarray) -> str:
    return " ".join(f"{float(v):.17g}" for v in values)


def _placo() -> ModuleType:
    try:
        import placo
    except ImportError as error:
        raise MissingDependencyError("placo", "placo", 'backend="placo"') from error
    return placo
