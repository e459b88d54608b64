"""Two independent judges of a robot: pinocchio for kinematics, a balance controller for physics."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from omni_envs.robots import SIDES, Robot
from omni_envs.scenes import PhysicsOptions, Scene, SceneObject, build_spec

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


def _link(body: str) -> str:
    """Name of a body's link: joints and links share one namespace there."""
    return f"{body}_body"


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
            f"<link name={quoteattr(_link(body.name))}><inertial>{centre}"
            f'<mass value="{body.mass:.17g}"/><inertia {entries}/></inertial></link>'
        )
        if body.name == robot.root_body:
            continue
        (joint,) = body.joints
        assert not np.any(joint.pos), "a URDF joint sits at its link's origin"
        lines.append(
            f'<joint name={quoteattr(joint.name)} type="revolute">'
            f"{_origin(body.pos, _rotation(body.quat))}"
            f"<parent link={quoteattr(_link(body.parent.name))}/>"
            f"<child link={quoteattr(_link(body.name))}/>"
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
                pose, body = np.array(other.get_T_world_frame(_link(name))), data.body(name)
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


BUILDS = {"kinematics": None, "physics": PhysicsOptions()}


def contacts(model: mujoco.MjModel, qpos: np.ndarray) -> dict[tuple[str, str], float]:
    """Penetrating pairs of the robot's bodies and their depth (m)."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    found: dict[tuple[str, str], float] = {}
    for geoms, distance in zip(data.contact.geom, data.contact.dist, strict=True):
        bodies = np.sort(model.geom_bodyid[geoms])
        if distance < 0 and bodies[0] > 0:
            pair = model.body(bodies[0]).name, model.body(bodies[1]).name
            found[pair] = max(found.get(pair, 0.0), -float(distance))
    return found


@pytest.fixture
def touching() -> Callable[[Robot, str, dict[str, float]], dict[tuple[str, str], float]]:
    """Pairs of bodies in contact, default pose but for the given joints, build, in the air."""

    def find(robot: Robot, build: str, joints: dict[str, float]) -> dict[tuple[str, str], float]:
        model = build_spec(robot, Scene(), BUILDS[build], looks=False).compile()
        qpos = robot.default_qpos.copy()
        qpos[2] += 1.0
        for joint, value in joints.items():
            low, high = robot.joint_ranges[robot.joint_names.index(joint)]
            assert low <= value <= high
            qpos[7 + robot.joint_names.index(joint)] = value
        return contacts(model, qpos)

    return find


def extent(model: mujoco.MjModel, geoms: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
    """(3,) lowest and highest coordinates of geoms in the frame of their body, m."""
    boxes = []
    for geom in geoms:
        kind, size = int(model.geom_type[geom]), model.geom_size[geom]
        turn = np.abs(_rotation(model.geom_quat[geom]).as_matrix())
        if kind == int(mujoco.mjtGeom.mjGEOM_BOX):
            half = turn @ size
        else:
            length = size[1] if kind == int(mujoco.mjtGeom.mjGEOM_CAPSULE) else 0.0
            half = turn[:, 2] * length + size[0]
        boxes.append((model.geom_pos[geom] - half, model.geom_pos[geom] + half))
    low, high = zip(*boxes, strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)


def geoms_of(model: mujoco.MjModel, body: str, groups: tuple[int, ...]) -> list[int]:
    """Geoms of a body in groups."""
    owner = model.body(body).id
    return [
        g
        for g in range(model.ngeom)
        if model.geom_bodyid[g] == owner and model.geom_group[g] in groups
    ]


@pytest.fixture
def hull_extent() -> Callable[[Robot, str], tuple[np.ndarray, np.ndarray]]:
    """(3,) lowest and highest coordinates of what collides on a body, in its frame."""

    def measure(robot: Robot, body: str) -> tuple[np.ndarray, np.ndarray]:
        return extent(robot.model, geoms_of(robot.model, body, (3, 4)))

    return measure


@pytest.fixture
def check_rubber() -> Callable[[Robot, set[str]], None]:
    """The given geoms, left and right, and no others resist a twist as a patch of rubber does."""

    def check(robot: Robot, parts: set[str]) -> None:
        # A disc of radius r under even pressure slides in rotation at 2/3 μ r per newton.
        patch = 2 / 3 * SceneObject.friction * 0.03
        rubber = set()
        for physics in BUILDS.values():
            built = build_spec(robot, Scene(), physics, looks=False).compile()
            soft = built.geom_condim[1:] == 4
            assert built.geom_friction[1:, 1] == pytest.approx(np.where(soft, patch, 0.005))
            assert np.all(built.geom_friction[1:, 0] == 0.6)
            rubber |= {built.geom(g + 1).name for g in np.flatnonzero(soft)}
        assert rubber == {f"{side}_{part}" for side in SIDES for part in parts}

    return check


@pytest.fixture
def check_geoms() -> Callable[[Robot, set[str]], None]:
    """Primitives only, looks that never collide, friction on the given bodies, few geoms."""

    def check(robot: Robot, bodies: set[str]) -> None:
        model = robot.model
        looks = model.geom_group == 2
        assert model.nmesh == 0 and looks.sum() > 60
        assert not np.any(model.geom_contype[looks]) and not np.any(model.geom_conaffinity[looks])
        assert np.all(np.isin(model.geom_group[~looks], (3, 4, 5)))
        for physics in BUILDS.values():
            built = build_spec(robot, Scene(), physics, looks=False).compile()
            assert built.ngeom < 45  # every geom is paid for in every step
            assert np.all(built.geom_condim[1:] >= 3) and np.all(built.geom_friction[1:, 0] >= 0.5)
            assert {built.body(b).name for b in built.geom_bodyid} >= bodies

    return check


@pytest.fixture
def check_soles() -> Callable[[Robot], None]:
    """Flat soles on the ground in the default pose; nothing of the foot below them."""

    def check(robot: Robot) -> None:
        model, data = robot.model, mujoco.MjData(robot.model)
        data.qpos[:] = robot.default_qpos
        mujoco.mj_kinematics(model, data)
        for foot in robot.feet.values():
            sole, body = np.array(foot.sole), data.body(foot.body)
            plane = sole[0, 2]
            assert np.all(sole[:, 2] == plane) and sole[-1, 0] == sole[:, 0].max()
            height = (body.xpos + sole @ body.xmat.reshape(3, 3).T)[:, 2]
            np.testing.assert_allclose(height, 0.0, atol=1e-4)
            for group in (4, 5):  # flat soles for kinematics, sole points for physics
                geoms = geoms_of(model, foot.body, (group,))
                for g in geoms:
                    assert extent(model, [g])[0][2] == pytest.approx(plane, abs=1e-9)
                low, high = extent(model, geoms)
                assert np.all(sole[:, :2] >= low[:2] - 0.001), "the sole carries every point"
                assert np.all(sole[:, :2] <= high[:2] + 0.001), "the sole carries every point"
            assert len(geoms_of(model, foot.body, (5,))) == 4
            for g in geoms_of(model, foot.body, (3,)):
                assert extent(model, [g])[0][2] > plane + 0.001

    return check


@pytest.fixture
def check_mirror() -> Callable[[Robot, Callable[[str], str], Callable[[str], bool]], None]:
    """Mirrored joint states put mirrored keypoints.

    Takes the robot, what names the joint of the other side, and which joints change sign.
    """

    def check(robot: Robot, other: Callable[[str], str], flips: Callable[[str], bool]) -> None:
        flip = np.array([-1.0 if flips(j) else 1.0 for j in robot.joint_names])
        swap = [robot.joint_names.index(other(j)) for j in robot.joint_names]
        mirrored = np.sort(flip[:, None] * robot.joint_ranges[swap], axis=1)
        np.testing.assert_array_equal(robot.joint_ranges, mirrored)
        np.testing.assert_array_equal(
            robot.default_joint_array, flip * robot.default_joint_array[swap]
        )
        data, random = mujoco.MjData(robot.model), np.random.default_rng(1)
        data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
        for _ in range(20):
            joints = random.uniform(*robot.joint_ranges.T)
            points = []
            for state in (joints, flip * joints[swap]):
                data.qpos[7:] = state
                mujoco.mj_kinematics(robot.model, data)
                points.append(keypoints_of(robot, data))
            for name, point in points[0].items():
                same = name.replace("left", "?").replace("right", "left").replace("?", "right")
                np.testing.assert_allclose(point * (1, -1, 1), points[1][same], atol=1e-6)

    return check


def keypoints_of(robot: Robot, data: mujoco.MjData) -> dict[str, np.ndarray]:
    """World keypoints of a pose whose kinematics are up to date."""
    return {
        k: data.body(p.body).xpos + data.body(p.body).xmat.reshape(3, 3) @ p.offset
        for k, p in robot.keypoints.items()
    }


@pytest.fixture
def standing() -> Callable[[Robot], dict[str, np.ndarray]]:
    """World keypoints of the default pose."""

    def measure(robot: Robot) -> dict[str, np.ndarray]:
        data = mujoco.MjData(robot.model)
        data.qpos[:] = robot.default_qpos
        mujoco.mj_kinematics(robot.model, data)
        return keypoints_of(robot, data)

    return measure


@pytest.fixture
def check_actuators() -> Callable[[Robot, dict[str, tuple]], None]:
    """Compiled gains, limits and armature against (range, kp, kd, effort, speed, scale)."""

    def check(robot: Robot, joints: dict[str, tuple]) -> None:
        model = robot.model
        assert list(robot.joint_names) == list(joints)
        for i, (name, expected) in enumerate(joints.items()):
            limits, kp, kd, effort, speed, scale = expected
            np.testing.assert_allclose(model.joint(name).range, limits, atol=1e-12)
            assert model.actuator_trnid[i, 0] == model.joint(name).id
            assert model.actuator_gainprm[i, 0] == kp
            assert tuple(model.actuator_biasprm[i, :3]) == (0, -kp, -kd)
            assert tuple(model.actuator_forcerange[i]) == (-effort, effort)
            assert model.actuator_forcelimited[i]
            assert robot.velocity_limits[i] == speed
            assert robot.action_scale[i] == pytest.approx(scale, abs=5e-4)

    return check
