"""The Unitree H1: masses, gains and frames to the manufacturer's, shells to the true ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from omni_envs.robots import H1, SIDES, Robot

# Body: mass (kg), principal inertia (g m²); left stands for both sides.
INERTIAL = {
    "pelvis": (5.39, (49.0211, 44.5821, 8.24619)),
    "left_hip_yaw_link": (2.244, (3.04494, 2.96885, 1.89201)),
    "left_hip_roll_link": (2.232, (2.43264, 2.25325, 2.05492)),
    "left_hip_pitch_link": (4.152, (82.9503, 82.1457, 5.10909)),
    "left_knee_link": (1.721, (12.5237, 12.3104, 1.9428)),
    "left_ankle_link": (0.446, (2.20848, 2.18961, 0.214202)),
    "torso_link": (17.789, (487.315, 409.628, 127.837)),
    "left_shoulder_pitch_link": (1.033, (1.29936, 0.987113, 0.858198)),
    "left_shoulder_roll_link": (0.793, (1.70388, 1.58256, 1.00336)),
    "left_shoulder_yaw_link": (0.839, (4.08038, 3.70367, 0.622687)),
    "left_elbow_link": (0.669, (6.01829, 6.00579, 0.408305)),
}

# Joint: range (rad) of the left side, kp, kd, effort, speed, action scale.
LEG = {
    "hip_yaw": ((-0.43, 0.43), 150, 2, 200, 23, 0.333),
    "hip_roll": ((-0.43, 0.43), 150, 2, 200, 23, 0.333),
    "hip_pitch": ((-3.14, 2.53), 150, 2, 200, 23, 0.333),
    "knee": ((-0.26, 2.05), 200, 4, 300, 14, 0.375),
    "ankle": ((-0.87, 0.52), 40, 2, 40, 9, 0.25),
}
ARM = {
    "shoulder_pitch": ((-2.87, 2.87), 100, 2, 40, 9, 0.1),
    "shoulder_roll": ((-0.34, 3.11), 50, 2, 40, 9, 0.2),
    "shoulder_yaw": ((-1.3, 4.45), 50, 2, 18, 20, 0.09),
    "elbow": ((-1.25, 2.61), 50, 2, 18, 20, 0.09),
}
TORSO = ((-2.35, 2.35), 300, 6, 200, 23, 0.1667)


def flips(joint: str) -> bool:
    return "roll" in joint or "yaw" in joint or joint == "torso"


def other(name: str) -> str:
    return name.replace("left", "?").replace("right", "left").replace("?", "right")


def limb(side: str, joints: dict[str, tuple]) -> dict[str, tuple]:
    table = {}
    for joint, ((low, high), *rest) in joints.items():
        limits = (-high, -low) if side == "right" and flips(joint) else (low, high)
        table[f"{side}_{joint}"] = (limits, *rest)
    return table


def test_joints_gains_and_limits(check_actuators: Callable[[Robot, dict], None]) -> None:
    legs = limb("left", LEG) | limb("right", LEG)
    check_actuators(H1, legs | {"torso": TORSO} | limb("left", ARM) | limb("right", ARM))
    assert (H1.nq, H1.nv, len(H1.body_names)) == (26, 25, 20)
    np.testing.assert_array_equal(H1.model.dof_armature[6:], 0.1)


def test_masses_and_inertias() -> None:
    model = H1.model
    assert model.body_subtreemass[1] == pytest.approx(51.437, abs=1e-9)
    for name in H1.body_names:
        mass, inertia = INERTIAL[name.replace("right_", "left_")]
        assert model.body(name).mass[0] == pytest.approx(mass, abs=1e-12)
        np.testing.assert_allclose(model.body(name).inertia, 1e-3 * np.array(inertia), rtol=1e-6)


def test_kinematics_and_dynamics_against_pinocchio(
    check_against_pinocchio: Callable[[Robot], None],
) -> None:
    check_against_pinocchio(H1)


def test_left_and_right_mirror(check_mirror: Callable[..., None]) -> None:
    check_mirror(H1, other, flips)


def test_default_pose() -> None:
    pose = dict(zip(H1.joint_names, H1.default_joint_array, strict=True))
    expected = {"hip_pitch": -0.1, "knee": 0.3, "ankle": -0.2, "shoulder_pitch": 0.2, "elbow": 0.32}
    for joint, value in pose.items():
        assert value == expected.get(joint.split("_", 1)[-1], 0.0)


def test_keypoints(standing: Callable[[Robot], dict[str, np.ndarray]]) -> None:
    points = standing(H1)
    for side, sign in zip(SIDES, (1, -1), strict=True):
        joint = {k.split("_", 1)[1]: p for k, p in points.items() if k.startswith(side)}
        assert np.linalg.norm(joint["knee"] - joint["hip"]) == pytest.approx(0.4, abs=1e-9)
        assert np.linalg.norm(joint["ankle"] - joint["knee"]) == pytest.approx(0.4, abs=1e-9)
        upper_arm = np.linalg.norm(joint["elbow"] - joint["shoulder"])
        assert upper_arm == pytest.approx(np.hypot(0.1343 + 0.198, 0.0185), abs=1e-9)
        assert np.linalg.norm(joint["hand"] - joint["elbow"]) == pytest.approx(0.2009, abs=1e-4)
        # The toe lies 5 mm above the sole.
        assert joint["toe"][2] == pytest.approx(0.005, abs=1e-4)
        assert joint["toe"][0] == pytest.approx(joint["ankle"][0] + 0.2, abs=1e-4)
        assert all(sign * p[1] > 0.15 for p in joint.values())
    np.testing.assert_array_equal(points["pelvis"], H1.default_qpos[:3])


def test_bodies_that_are_tracked() -> None:
    assert len(H1.tracked_bodies) == 14 and set(H1.end_effectors) < set(H1.tracked_bodies)
    assert H1.anchor_body == H1.root_body == "pelvis" and H1.torso_body == "torso_link"


def test_geoms(check_geoms: Callable[[Robot, set[str]], None]) -> None:
    limbs = ("hip_pitch", "knee", "ankle", "shoulder_yaw", "elbow")
    check_geoms(H1, {"pelvis", "torso_link", *(f"{s}_{b}_link" for s in SIDES for b in limbs)})


def test_soles_are_flat_and_touch_the_ground(check_soles: Callable[[Robot], None]) -> None:
    check_soles(H1)


@pytest.mark.parametrize(
    ("body", "low", "high"),
    [  # of the manufacturer's shells, where they are what is touched
        ("torso_link", (-0.073, -0.171, 0.025), (0.125, 0.171, 0.762)),
        ("left_hip_pitch_link", (-0.061, -0.094, -0.446), (0.061, 0.03, 0.061)),
        ("left_knee_link", (-0.056, -0.048, -0.415), (0.051, 0.0355, 0.047)),
        ("left_ankle_link", (-0.1, -0.015, -0.07), (0.2, 0.015, 0.011)),
        ("left_elbow_link", (-0.046, -0.031, -0.048), (0.27, 0.031, 0.046)),
    ],
)
def test_hulls_have_the_extent_of_the_shells(
    hull_extent: Callable, body: str, low: tuple, high: tuple
) -> None:
    found = hull_extent(H1, body)
    # Discs at the ends of a limb overlap those of its neighbours, which stand for both.
    inside = 0.06 if body == "left_elbow_link" else 0.025
    for a, b, outward in ((found[0], low, -1), (found[1], high, 1)):
        gap = outward * (np.array(a) - b)
        assert np.all(gap < 0.012) and np.all(gap > -inside)


@pytest.mark.parametrize("build", ["kinematics", "physics"])
def test_default_and_zero_pose_are_free_of_self_collision(touching: Callable, build: str) -> None:
    assert touching(H1, build, {}) == {}
    assert touching(H1, build, dict.fromkeys(H1.joint_names, 0.0)) == {}


@pytest.mark.parametrize("build", ["kinematics", "physics"])
@pytest.mark.parametrize(
    ("joints", "bodies"),
    [
        ({"left_hip_roll": -0.35, "right_hip_roll": 0.35}, ("left_knee", "right_knee")),
        ({"left_shoulder_roll": -0.3, "left_shoulder_pitch": 0.0}, ("torso", "left_elbow")),
        ({"left_hip_pitch": -2.9}, ("left_elbow", "left_hip_pitch")),
    ],
)
def test_limbs_do_not_pass_through_each_other(
    touching: Callable, build: str, joints: dict[str, float], bodies: tuple[str, str]
) -> None:
    found = {frozenset(pair) for pair in touching(H1, build, joints)}
    assert frozenset(f"{b}_link" for b in bodies) in found


def test_stands_under_its_gains(check_stands: Callable[[Robot], None]) -> None:
    check_stands(H1)
