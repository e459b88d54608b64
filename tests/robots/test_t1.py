"""The Booster T1: masses, gains and frames to the manufacturer's, shells to the true ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from omni_envs.robots import SIDES, T1, Robot

# Body: mass (kg), principal inertia (g m²); left stands for both sides, where right is not named.
INERTIAL = {
    "Trunk": (11.7, (91.5404, 76.7787, 55.6055)),
    "H1": (0.44391, (0.241549, 0.22351, 0.149941)),
    "H2": (0.631019, (2.03553, 1.92467, 1.72381)),
    "AL1": (0.53, (1.367, 1.29329, 0.292711)),
    "AL2": (0.16, (0.401, 0.34538, 0.17662)),
    "AL3": (1.02, (12.869, 12.798, 0.620953)),
    "left_hand_link": (0.327214, (8.159, 8.13104, 0.214962)),
    "Waist": (2.581, (5.36742, 5.299, 4.74258)),
    "Hip_Pitch_Left": (1.021, (1.80547, 1.45926, 1.25327)),
    "Hip_Pitch_Right": (1.021, (1.80552, 1.4632, 1.24928)),
    "Hip_Roll_Left": (0.385, (1.743, 1.51729, 0.514712)),
    "Hip_Yaw_Left": (2.166, (25.7334, 25.3024, 2.59215)),
    "Hip_Yaw_Right": (2.17, (25.7623, 25.3298, 2.59389)),
    "Shank_Left": (1.73, (34.6951, 34.5375, 1.85844)),
    "Shank_Right": (1.79, (35.1717, 34.9574, 1.96589)),
    "Ankle_Cross_Left": (0.073, (0.029, 0.0256589, 0.0113411)),
    "left_foot_link": (0.685, (2.69786, 2.385, 2.18714)),
}

# Joint: range (rad) of the left side, kp, kd, effort, speed, action scale.
HEAD = {
    "AAHead_yaw": ((-1.57, 1.57), 5, 0.5, 7, 12.56, 0.35),
    "Head_pitch": ((-0.35, 1.22), 5, 0.5, 7, 12.56, 0.35),
}
ARM = {
    "Shoulder_Pitch": ((-3.31, 1.22), 20, 0.5, 18, 18.84, 0.225),
    "Shoulder_Roll": ((-1.74, 1.57), 20, 0.5, 18, 18.84, 0.225),
    "Elbow_Pitch": ((-2.27, 2.27), 20, 0.5, 18, 18.84, 0.225),
    "Elbow_Yaw": ((-2.44, 0.0), 20, 0.5, 18, 18.84, 0.225),
}
WAIST = {"Waist": ((-1.57, 1.57), 200, 5, 30, 10.88, 0.0375)}
LEG = {
    "Hip_Pitch": ((-1.8, 1.57), 200, 5, 45, 12.5, 0.056),
    "Hip_Roll": ((-0.2, 1.57), 200, 5, 30, 10.9, 0.0375),
    "Hip_Yaw": ((-1.0, 1.0), 200, 5, 30, 10.9, 0.0375),
    "Knee_Pitch": ((0.0, 2.34), 200, 5, 60, 11.7, 0.075),
    "Ankle_Pitch": ((-0.87, 0.35), 50, 3, 20, 18.8, 0.1),
    "Ankle_Roll": ((-0.44, 0.44), 50, 3, 15, 12.4, 0.075),
}


def flips(joint: str) -> bool:
    return "Roll" in joint or "yaw" in joint.lower() or joint == "Waist"


def other(name: str) -> str:
    return name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")


def limb(side: str, joints: dict[str, tuple]) -> dict[str, tuple]:
    table = {}
    for joint, ((low, high), *rest) in joints.items():
        limits = (-high, -low) if side == "Right" and flips(joint) else (low, high)
        table[f"{side}_{joint}"] = (limits, *rest)
    return table


def test_joints_gains_and_limits(check_actuators: Callable[[Robot, dict], None]) -> None:
    arms, legs = (limb("Left", j) | limb("Right", j) for j in (ARM, LEG))
    check_actuators(T1, HEAD | arms | WAIST | legs)
    assert (T1.nq, T1.nv, len(T1.body_names)) == (30, 29, 24)
    np.testing.assert_array_equal(T1.model.dof_armature[6:], 0.03)


def test_masses_and_inertias() -> None:
    model = T1.model
    assert model.body_subtreemass[1] == pytest.approx(31.614357, abs=1e-9)
    for name in T1.body_names:
        left = name.replace("AR", "AL").replace("Right", "Left").replace("right", "left")
        mass, inertia = INERTIAL.get(name) or INERTIAL[left]
        assert model.body(name).mass[0] == pytest.approx(mass, abs=1e-12)
        np.testing.assert_allclose(model.body(name).inertia, 1e-3 * np.array(inertia), rtol=1e-6)


def test_kinematics_and_dynamics_against_pinocchio(
    check_against_pinocchio: Callable[[Robot], None],
) -> None:
    check_against_pinocchio(T1)


def test_left_and_right_mirror(check_mirror: Callable[..., None]) -> None:
    check_mirror(T1, other, flips)


def test_default_pose() -> None:
    pose = dict(zip(T1.joint_names, T1.default_joint_array, strict=True))
    expected = {
        "Shoulder_Pitch": 0.2,
        "Shoulder_Roll": -1.35,
        "Elbow_Yaw": -0.5,
        "Hip_Pitch": -0.2,
        "Knee_Pitch": 0.4,
        "Ankle_Pitch": -0.2,
    }
    for joint, value in pose.items():
        sign = -1 if joint.startswith("Right") and flips(joint) else 1
        assert value == sign * expected.get(joint.split("_", 1)[-1], 0.0)


def test_keypoints(standing: Callable[[Robot], dict[str, np.ndarray]]) -> None:
    points = standing(T1)
    for side, sign in zip(SIDES, (1, -1), strict=True):
        joint = {k.split("_", 1)[1]: p for k, p in points.items() if k.startswith(side)}
        thigh = np.linalg.norm(joint["knee"] - joint["hip"])
        assert thigh == pytest.approx(np.hypot(0.02 + 0.081854 + 0.134, 0.014), abs=1e-9)
        assert np.linalg.norm(joint["ankle"] - joint["knee"]) == pytest.approx(0.28, abs=1e-9)
        assert np.linalg.norm(joint["hand"] - joint["elbow"]) == pytest.approx(0.2, abs=1e-9)
        assert joint["toe"][2] == pytest.approx(0.0, abs=1e-4)
        assert joint["toe"][0] > joint["ankle"][0] + 0.1
        assert joint["hand"][2] < joint["elbow"][2] < joint["shoulder"][2]
        assert all(sign * p[1] > 0.1 for p in joint.values())
    np.testing.assert_array_equal(points["pelvis"], T1.default_qpos[:3])


def test_the_root_is_the_upper_body() -> None:
    assert len(T1.tracked_bodies) == 14 and set(T1.end_effectors) < set(T1.tracked_bodies)
    assert T1.anchor_body == T1.root_body == T1.torso_body == "Trunk"
    assert T1.model.body("Waist").parentid[0] == T1.model.body("Trunk").id
    assert T1.model.body("Hip_Pitch_Left").parentid[0] == T1.model.body("Waist").id


def test_geoms(check_geoms: Callable[[Robot, set[str]], None]) -> None:
    limbs = ("Hip_Yaw_Left", "Shank_Left", "Hip_Yaw_Right", "Shank_Right", "AL3", "AR3")
    ends = {f"{s}_{b}_link" for s in SIDES for b in ("hand", "foot")}
    check_geoms(T1, {"Trunk", "Waist", "H2", *limbs, *ends})


def test_rubber_hands_resist_a_twist(check_rubber: Callable[[Robot, set[str]], None]) -> None:
    check_rubber(T1, {"hand_hull"})


def test_soles_are_flat_and_touch_the_ground(check_soles: Callable[[Robot], None]) -> None:
    check_soles(T1)


@pytest.mark.parametrize(
    ("body", "low", "high"),
    [  # of the manufacturer's shells
        ("Trunk", (-0.029, -0.1215, -0.0515), (0.153, 0.1215, 0.279)),
        ("H2", (-0.0585, -0.0713, 0.024), (0.0816, 0.0703, 0.188)),
        ("Hip_Yaw_Left", (-0.068, -0.0445, -0.188), (0.0445, 0.0445, 0.004)),
        ("Shank_Left", (-0.049, -0.037, -0.292), (0.05, 0.037, 0.005)),
        ("left_foot_link", (-0.102, -0.05, -0.031), (0.123, 0.05, 0.02)),
        ("left_hand_link", (-0.03, -0.0285, -0.0363), (0.03, 0.2465, 0.0368)),
    ],
)
def test_hulls_have_the_extent_of_the_shells(
    hull_extent: Callable, body: str, low: tuple, high: tuple
) -> None:
    found = hull_extent(T1, body)
    for a, b, outward in ((found[0], low, -1), (found[1], high, 1)):
        gap = outward * (np.array(a) - b)
        assert np.all(gap < 0.008) and np.all(gap > -0.02)


@pytest.mark.parametrize("build", ["kinematics", "physics"])
def test_default_and_zero_pose_are_free_of_self_collision(touching: Callable, build: str) -> None:
    assert touching(T1, build, {}) == {}
    assert touching(T1, build, dict.fromkeys(T1.joint_names, 0.0)) == {}


@pytest.mark.parametrize("build", ["kinematics", "physics"])
@pytest.mark.parametrize(
    ("joints", "bodies"),
    [
        ({"Left_Hip_Roll": -0.2, "Right_Hip_Roll": 0.2}, ("left_foot_link", "right_foot_link")),
        ({"Left_Shoulder_Roll": -1.7}, ("Trunk", "left_hand_link")),
        ({"Left_Elbow_Yaw": -2.4, "Left_Elbow_Pitch": 1.5}, ("Trunk", "left_hand_link")),
    ],
)
def test_limbs_do_not_pass_through_each_other(
    touching: Callable, build: str, joints: dict[str, float], bodies: tuple[str, str]
) -> None:
    assert frozenset(bodies) in {frozenset(pair) for pair in touching(T1, build, joints)}


def test_stands_under_its_gains(check_stands: Callable[[Robot], None]) -> None:
    check_stands(T1)
