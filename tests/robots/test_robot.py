"""A robot's description: what it derives, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.robots import G1, H1, T1, Actuator, Foot, Robot


def without(table: dict, name: str) -> dict:
    return {k: v for k, v in table.items() if k != name}


def test_arrays_follow_model_order() -> None:
    model = G1.model
    assert (G1.nq, G1.nv, G1.num_joints) == (model.nq, model.nv, model.nu)
    assert G1.joint_names == tuple(model.joint(i).name for i in range(1, model.njnt))
    assert G1.body_names[0] == G1.root_body
    for i, name in enumerate(G1.joint_names):
        assert model.jnt_qposadr[model.joint(name).id] == 7 + i
        assert G1.default_joint_array[i] == G1.default_joint_positions.get(name, 0.0)
        assert tuple(G1.joint_ranges[i]) == tuple(model.joint(name).range)
        assert G1.action_scale[i] == pytest.approx(
            0.25 * G1.actuators[i].effort / G1.actuators[i].stiffness
        )
        assert G1.velocity_limits[i] == G1.actuators[i].velocity_limit
    np.testing.assert_array_equal(G1.default_qpos[:7], (0, 0, G1.default_root_height, 1, 0, 0, 0))
    np.testing.assert_array_equal(G1.default_qpos[7:], G1.default_joint_array)


def test_reference_ranges_only_narrow() -> None:
    narrow, wide = G1.reference_joint_ranges, G1.joint_ranges
    assert np.all(narrow[:, 0] >= wide[:, 0]) and np.all(narrow[:, 1] <= wide[:, 1])
    changed = {
        n for n, a, b in zip(G1.joint_names, narrow, wide, strict=True) if tuple(a) != tuple(b)
    }
    assert changed == set(G1.reference_ranges)
    wider = replace(G1, reference_ranges={"left_elbow_joint": (-9.0, 1.4)})
    low, high = wider.reference_joint_ranges[G1.joint_names.index("left_elbow_joint")]
    assert (low, high) == (-1.0472, 1.4)


def test_actuators_are_position_servos_with_saturation() -> None:
    model, data = G1.model, mujoco.MjData(G1.model)
    random = np.random.default_rng(0)
    data.qpos[:], data.qvel[:] = G1.default_qpos, random.normal(size=G1.nv)
    data.qpos[7:] += random.uniform(-0.1, 0.1, G1.num_joints)
    data.ctrl[:] = data.qpos[7:] + random.uniform(-2.0, 2.0, G1.num_joints)
    mujoco.mj_forward(model, data)
    kp, kd, effort = np.array([(a.stiffness, a.damping, a.effort) for a in G1.actuators]).T
    torque = kp * (data.ctrl - data.qpos[7:]) - kd * data.qvel[6:]
    assert np.any(np.abs(torque) > effort) and np.any(np.abs(torque) < effort)
    np.testing.assert_allclose(data.qfrc_actuator[6:], np.clip(torque, -effort, effort), rtol=1e-9)


def test_spec_is_fresh_every_time() -> None:
    first = G1.spec()
    first.body(G1.root_body).mass = 99.0
    assert G1.spec().body(G1.root_body).mass != 99.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"keypoints": without(dict(G1.keypoints), "left_toe")}, r"keypoints .* no \['left_toe'\]"),
        ({"feet": without(dict(G1.feet), "right")}, r"feet .* no \['right'\]"),
        ({"contact_links": {}}, r"contact_links .* no \['left_hand'"),
        ({"actuators": (*G1.actuators, G1.actuators[3])}, r"actuators .* \['left_knee_joint'\]"),
        ({"default_joint_positions": {"knee": 0.1}}, r"default_joint_positions .* \['knee'\]"),
        ({"posture_weights": {"tail": 0.1}}, r"posture_weights .* \['tail'\]"),
        ({"reference_ranges": {"tail": (0, 1)}}, r"reference_ranges .* \['tail'\]"),
        ({"reference_ranges": {"left_knee_joint": (1, 0)}}, r"low < high; got left_knee_joint"),
    ],
)
def test_incomplete_descriptions_are_refused(changes: dict, message: str) -> None:
    with pytest.raises(InvalidDataError, match=message) as caught:
        replace(G1, **changes)
    assert str(caught.value).startswith("Robot 'g1': ")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"anchor_body": "tail"}, r"bodies .* unknown \['tail'\]"),
        ({"tracked_bodies": ("pelvis", "tail")}, r"unknown \['tail'\]"),
        ({"feet": {s: replace(f, body="hoof") for s, f in G1.feet.items()}}, r"unknown \['hoof'\]"),
        ({"actuators": G1.actuators[::-1]}, "the hinges of g1.xml after its free joint"),
        ({"root_body": "torso_link"}, "'pelvis', which is free; got 'torso_link'"),
    ],
)
def test_descriptions_that_do_not_fit_the_file_are_refused(changes: dict, message: str) -> None:
    with pytest.raises(InvalidDataError, match=message):
        replace(G1, **changes).spec()


def test_missing_actuators_are_refused() -> None:
    legs = G1.actuators[:12]
    partial = {j: v for j, v in G1.default_joint_positions.items() if j in {a.joint for a in legs}}
    robot = replace(
        G1, actuators=legs, default_joint_positions=partial, reference_ranges={}, posture_weights={}
    )
    with pytest.raises(InvalidDataError, match=r"the hinges of g1\.xml"):
        robot.spec()


@pytest.mark.parametrize(
    "text", ["", "<mujoco", "<mujoco><worldbody><body/></worldbody></mujoco>x"]
)
def test_broken_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=r"robot\.xml"):
        replace(G1, mjcf=path).spec()


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="expected an existing MJCF file"):
        replace(G1, mjcf=tmp_path / "none.xml").spec()


def test_a_file_without_joints_is_refused(tmp_path: Path) -> None:
    bodies = "".join(f'<body name="{b}"/>' for b in G1.body_names)
    path = tmp_path / "statue.xml"
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    with pytest.raises(InvalidDataError, match=r"the hinges of statue\.xml"):
        replace(G1, mjcf=path).spec()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("stiffness", 0.0),
        ("damping", -1.0),
        ("effort", float("inf")),
        ("velocity_limit", float("nan")),
        ("armature", -0.01),
    ],
)
def test_impossible_motors_are_refused(field: str, value: float) -> None:
    with pytest.raises(InvalidDataError, match=rf"Actuator 'left_knee_joint': {field} must be"):
        replace(G1.actuators[3], **{field: value})


def test_action_scale_is_a_quarter_of_the_effort_over_stiffness() -> None:
    assert Actuator("j", 50.0, 1.0, 20.0, 10.0, 0.01).action_scale == pytest.approx(0.1)


def test_a_sole_has_corners_and_a_toe() -> None:
    with pytest.raises(InvalidDataError, match="Foot 'left': sole must be"):
        Foot("left", ((0.0, 0.0, 0.0),))


def _surface(geom: tuple, rng: np.random.Generator) -> np.ndarray:
    """(K, 3) points on a geom."""
    kind, size, position, rotation = geom
    if kind == int(mujoco.mjtGeom.mjGEOM_BOX):
        local = rng.uniform(-1, 1, (400, 3))
        local[np.arange(400), rng.integers(3, size=400)] = rng.choice([-1, 1], 400)
        local *= size
    else:
        local = rng.normal(size=(400, 3))
        local *= size[0] / np.linalg.norm(local, axis=1, keepdims=True)
        local[:, 2] += size[1] * rng.uniform(-1, 1, 400).round()
    return local @ rotation.T + position


def _depth(points: np.ndarray, geoms: list[tuple]) -> np.ndarray:
    """(K,) signed distances of points to the union of geoms, m."""
    distances = []
    for kind, size, position, rotation in geoms:
        local = np.abs((points - position) @ rotation)
        if kind == int(mujoco.mjtGeom.mjGEOM_BOX):
            outside = local - size
            away = np.linalg.norm(np.maximum(outside, 0), axis=1)
            distances.append(away + np.minimum(outside.max(1), 0))
        else:
            local[:, 2] = np.maximum(local[:, 2] - size[1], 0)
            distances.append(np.linalg.norm(local, axis=1) - size[0])
    return np.min(distances, axis=0)


@pytest.mark.parametrize(
    ("robot", "outside", "uncovered"),
    [(G1, 0.015, 0.045), (H1, 0.010, 0.010), (T1, 0.005, 0.022)],
    ids=lambda value: getattr(value, "name", None),
)
def test_coarse_hulls_of_physics_follow_the_fine_ones(
    robot: Robot, outside: float, uncovered: float
) -> None:
    model, rng = robot.model, np.random.default_rng(0)
    data = mujoco.MjData(model)
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(model, data)
    groups: dict[int, list[tuple]] = {3: [], 4: [], 5: []}
    for g in range(model.ngeom):
        kind, group = int(model.geom_type[g]), int(model.geom_group[g])
        size = model.geom_size[g] * (kind != int(mujoco.mjtGeom.mjGEOM_SPHERE) or (1, 0, 0))
        if group in groups and "sole" not in model.geom(g).name:
            groups[group].append((kind, size, data.geom_xpos[g], data.geom_xmat[g].reshape(3, 3)))
    fine, coarse = groups[3] + groups[4], groups[3] + groups[5]
    for hulls, others, limit in ((groups[5], fine, outside), (groups[4], coarse, uncovered)):
        own = groups[5] if hulls is groups[5] else groups[4]
        points = np.concatenate([_surface(g, rng) for g in hulls])
        points = points[_depth(points, own) > -1e-9]
        assert len(points) > 100
        assert _depth(points, others).max() < limit
