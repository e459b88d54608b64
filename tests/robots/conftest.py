"""Two independent judges of a robot: pinocchio for kinematics, a balance controller for physics."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from omni_envs.robots import Robot
from omni_envs.scenes import PhysicsOptions, Scene, build_spec

SUBSTEPS = 4  # physics steps per control step


@pytest.fixture(scope="session")
def shared() -> Path:
    """Measured data beside the repository; tests that need it skip where it is absent."""
    path = Path(os.environ.get("OMNI_ENVS_SHARED", Path(__file__).parents[3] / "shared"))
    if not path.is_dir():
        pytest.skip("no shared data: set OMNI_ENVS_SHARED")
    return path


def _rotation(wxyz: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.asarray(wxyz, float)[[1, 2, 3, 0]])


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{float(v):.17g}" for v in values)


def _origin(position: np.ndarray, rotation: Rotation) -> str:
    return f'<origin xyz="{_numbers(position)}" rpy="{_numbers(rotation.as_euler("xyz"))}"/>'


def urdf(robot: Robot) -> str:
    """Writes the robot as a URDF from the uncompiled specification, without MuJoCo's arithmetic."""
    lines = [f'<robot name="{robot.name}">']
    for body in robot.spec().bodies[1:]:
        rotation = _rotation(body.iquat).as_matrix()
        inertia = rotation @ np.diag(body.inertia) @ rotation.T
        entries = " ".join(
            f'i{a}{b}="{inertia["xyz".index(a), "xyz".index(b)]:.17g}"'
            for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")
        )
        centre = _origin(body.ipos, Rotation.identity())
        lines.append(
            f"<link name={quoteattr(body.name)}><inertial>{centre}"
            f'<mass value="{body.mass:.17g}"/><inertia {entries}/></inertial></link>'
        )
        if body.name == robot.root_body:
            continue
        (joint,) = body.joints
        assert not np.any(joint.pos), "a URDF joint sits at its link's origin"
        lines.append(
            f'<joint name={quoteattr(joint.name)} type="revolute">'
            f"{_origin(body.pos, _rotation(body.quat))}"
            f"<parent link={quoteattr(body.parent.name)}/><child link={quoteattr(body.name)}/>"
            f'<axis xyz="{_numbers(joint.axis)}"/>'
            f'<limit lower="{joint.range[0]:.17g}" upper="{joint.range[1]:.17g}"'
            ' effort="1" velocity="1"/></joint>'
        )
    return "\n".join([*lines, "</robot>"])


@pytest.fixture
def check_against_pinocchio(tmp_path: Path) -> Callable[[Robot], None]:
    """Compares body frames, mass, centre of mass and joint-space inertia at random states."""

    def check(robot: Robot) -> None:
        placo = pytest.importorskip("placo")
        path = tmp_path / "robot.urdf"
        path.write_text(urdf(robot))
        other = placo.RobotWrapper(str(path), placo.Flags.ignore_collisions)
        assert tuple(other.joint_names()) == robot.joint_names
        rows = [other.get_joint_v_offset(j) for j in robot.joint_names]
        model, data = robot.model, mujoco.MjData(robot.model)
        armature = np.diag(model.dof_armature[6:])
        full = np.empty((model.nv, model.nv))
        random = np.random.default_rng(0)
        assert other.total_mass() == pytest.approx(model.body_subtreemass[1], abs=1e-9)
        for _ in range(20):
            data.qpos[:3] = random.uniform(-1, 1, 3)
            data.qpos[3:7] = (lambda q: q / np.linalg.norm(q))(random.normal(size=4))
            data.qpos[7:] = random.uniform(*robot.joint_ranges.T)
            mujoco.mj_forward(model, data)
            base = np.eye(4)
            base[:3, :3], base[:3, 3] = _rotation(data.qpos[3:7]).as_matrix(), data.qpos[:3]
            other.set_T_world_fbase(base)
            for joint, value in zip(robot.joint_names, data.qpos[7:], strict=True):
                other.set_joint(joint, float(value))
            other.update_kinematics()
            for name in robot.body_names:
                pose, body = np.array(other.get_T_world_frame(name)), data.body(name)
                np.testing.assert_allclose(body.xpos, pose[:3, 3], atol=1e-6, err_msg=name)
                np.testing.assert_allclose(
                    body.xmat.reshape(3, 3), pose[:3, :3], atol=1e-6, err_msg=name
                )
            np.testing.assert_allclose(data.subtree_com[1], other.com_world(), atol=1e-6)
            mujoco.mj_fullM(model, data, full)
            np.testing.assert_allclose(
                full[6:, 6:] - armature, other.mass_matrix()[np.ix_(rows, rows)], atol=1e-6
            )

    return check


def _balance(robot: Robot, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Resting pose, joint targets that hold it, and the feedback that makes it stable.

    Gains of 10 Hz on the rotors make ankles (57 N m / rad for the G1) that are softer than gravity
    (about 210 N m / rad): no constant target can stand. The feedback is a linear-quadratic
    regulator on the joint targets at the control rate.
    """
    data, nv = mujoco.MjData(model), model.nv

    def force(z: np.ndarray) -> np.ndarray:
        """Vertical force and pitching moment that the ground fails to give (mm, mrad)."""
        data.qpos[:], data.qvel[:] = robot.default_qpos, 0.0
        data.qpos[2] += 1e-3 * z[0]
        data.qpos[3], data.qpos[5] = np.cos(5e-4 * z[1]), np.sin(5e-4 * z[1])
        mujoco.mj_forward(model, data)
        data.qacc[:] = 0.0
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse[[2, 4]]

    # Start with flat soles, 1 mm in the ground.
    pitch = -sum(
        robot.default_joint_positions.get(f"left_{j}_joint", 0.0)
        for j in ("hip_pitch", "knee", "ankle_pitch")
    )
    solution = root(force, [-1.0, 1e3 * pitch])
    assert solution.success and np.abs(force(solution.x)).max() < 1e-3
    pose = data.qpos.copy()
    stiffness = np.array([a.stiffness for a in robot.actuators])
    target = robot.default_joint_array + data.qfrc_inverse[6:] / stiffness
    data.ctrl[:] = target
    a, b = np.zeros((2 * nv, 2 * nv)), np.zeros((2 * nv, model.nu))
    mujoco.mj_forward(model, data)
    mujoco.mjd_transitionFD(model, data, 1e-6, True, a, b, None, None)
    power, held = np.eye(2 * nv), np.zeros_like(b)
    for _ in range(SUBSTEPS):
        power, held = a @ power, a @ held + b
    mujoco.mj_forward(model, data)
    com = np.empty((3, nv))
    mujoco.mj_jacSubtreeCom(model, data, com, 1)
    cost = 1e-3 * np.eye(2 * nv)
    cost[:nv, :nv] += 1e3 * com.T @ com + np.diag([0.0] * 3 + [10.0] * 3 + [1.0] * (nv - 6))
    riccati = solve_discrete_are(power, held, cost, np.eye(model.nu))
    gain = np.linalg.solve(np.eye(model.nu) + held.T @ riccati @ held, held.T @ riccati @ power)
    return pose, target, gain


@pytest.fixture
def check_stands() -> Callable[[Robot], None]:
    """Stands 5 s under the compiled PD actuators, from the default pose, pushed at the start."""

    def check(robot: Robot) -> None:
        model = build_spec(robot, Scene(), PhysicsOptions(), looks=False).compile()
        pose, target, gain = _balance(robot, model)
        for push in ((0.0, 0.0), (0.1, 0.0), (-0.1, 0.0), (0.0, 0.1)):
            data, error = mujoco.MjData(model), np.zeros(2 * model.nv)
            data.qpos[:], data.qvel[:2] = robot.default_qpos, push
            while data.time < 5.0:
                mujoco.mj_differentiatePos(model, error[: model.nv], 1.0, pose, data.qpos)
                error[model.nv :] = data.qvel
                data.ctrl[:] = target - gain @ error
                mujoco.mj_step(model, data, SUBSTEPS)
            tilt = 2.0 * np.arcsin(np.linalg.norm(data.qpos[4:6]))
            assert tilt < np.radians(2.0)
            assert abs(data.qpos[2] - robot.default_root_height) < 0.005
            np.testing.assert_allclose(data.qpos[7:], robot.default_joint_array, atol=0.05)
            np.testing.assert_allclose(data.qvel, 0.0, atol=0.02)
            touching = {
                model.body(b).name for b in model.geom_bodyid[data.contact.geom].ravel() if b
            }
            assert touching == {f.body for f in robot.feet.values()}

    return check
