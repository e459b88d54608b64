import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs import rotations
from omni_envs.demonstrations import MOCAP, SMPLH, Demonstration
from omni_envs.retargeting.human_frames import (
    HUMAN_BODIES,
    estimate_frames,
    human_frames,
)
from omni_envs.robots import KEYPOINTS

# The T-pose in SMPL's axes: x left, y up, z forward.
T_POSE = {
    "pelvis": (0, 1.0, 0),
    "hip": (0.1, 0.9, 0),
    "knee": (0.1, 0.5, 0),
    "ankle": (0.1, 0.1, 0),
    "toe": (0.1, 0.1 - 0.15 * np.sin(0.4), 0.15 * np.cos(0.4)),
    "shoulder": (0.2, 1.4, 0),
    "elbow": (0.5, 1.4, 0),
    "hand": (0.75, 1.4, 0),
}
IDENTITY = [1.0, 0, 0, 0]


def pose(**moved) -> np.ndarray:
    """(1, 15, 3) T-pose with some keypoints moved."""
    points = []
    for name in KEYPOINTS:
        side, _, part = name.partition("_")
        point = np.array(T_POSE[part or name], float)
        points.append(moved.get(name, point * ((-1, 1, 1) if side == "right" else 1)))
    return np.array([points], float)


def frame(keypoints: np.ndarray, body: str) -> np.ndarray:
    return estimate_frames(keypoints)[0, HUMAN_BODIES.index(body)]


def turn(axis: str, degrees: float) -> np.ndarray:
    return Rotation.from_euler(axis, degrees, degrees=True).as_quat(scalar_first=True)


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.linalg.norm(rotations.difference(np.asarray(a), np.asarray(b)), axis=-1))


def test_t_pose_has_parallel_frames():
    frames = estimate_frames(pose())[0]
    assert frames.shape == (14, 4)
    np.testing.assert_allclose(angle(IDENTITY, frames), 0, atol=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
def test_bent_knee_turns_the_shin_about_x(side):
    x = 0.1 if side == "left" else -0.1
    # Shin backwards, foot square to it: a quarter turn of both about x.
    foot = np.array([0, -0.15 * np.sin(0.4), 0.15 * np.cos(0.4)])
    foot = Rotation.from_euler("x", 90, degrees=True).apply(foot)
    bent = pose(**{f"{side}_ankle": (x, 0.5, -0.4), f"{side}_toe": np.add(foot, (x, 0.5, -0.4))})
    assert angle(frame(bent, f"{side}_hip"), IDENTITY) < 1e-6
    assert angle(frame(bent, f"{side}_knee"), turn("x", 90)) < 1e-6
    assert angle(frame(bent, f"{side}_foot"), turn("x", 90)) < 1e-6


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_bent_elbow_turns_the_forearm_about_y(side, sign):
    bent = pose(**{f"{side}_hand": (0.5 * sign, 1.4, 0.25)})
    assert angle(frame(bent, f"{side}_shoulder"), IDENTITY) < 1e-6
    # The guess for a straight arm still weighs in.
    assert angle(frame(bent, f"{side}_elbow"), turn("y", -90 * sign)) < 2
    assert angle(frame(bent, f"{side}_wrist"), turn("y", -90 * sign)) < 2


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_a_straight_arm_hangs_with_the_elbow_axis_sideways(side, sign):
    x = 0.2 * sign
    hanging = pose(**{f"{side}_elbow": (x, 1.1, 0), f"{side}_hand": (x, 0.85, 0)})
    forward = rotations.rotate(frame(hanging, f"{side}_elbow"), np.array([0, 1.0, 0]))
    np.testing.assert_allclose(forward, [sign, 0, 0], atol=1e-6)


def test_frames_turn_with_the_body():
    rng = np.random.default_rng(0)
    keypoints = pose() + rng.normal(0, 0.03, (20, 15, 3))
    rotation = Rotation.random(random_state=1)
    turned = estimate_frames(rotation.apply(keypoints.reshape(-1, 3)).reshape(20, 15, 3))
    quaternion = rotation.as_quat(scalar_first=True)
    expected = rotations.multiply(quaternion, estimate_frames(keypoints))
    np.testing.assert_allclose(angle(turned, expected), 0, atol=1e-5)


@pytest.mark.parametrize("keypoints", [np.zeros((1, 15, 3)), np.ones((2, 15, 3))])
def test_coincident_keypoints_give_rotations(keypoints):
    with np.errstate(all="raise"):
        frames = estimate_frames(keypoints)
    np.testing.assert_allclose(np.linalg.norm(frames, axis=-1), 1)


def test_known_orientations_are_used():
    orientations = np.random.default_rng(2).normal(size=(3, SMPLH.num_joints, 4))
    orientations /= np.linalg.norm(orientations, axis=-1, keepdims=True)
    positions = np.random.default_rng(3).normal(size=(3, SMPLH.num_joints, 3))
    demonstration = Demonstration(
        "x", 30.0, SMPLH.joint_names, positions, SMPLH.keypoint_joints, 1.7,
        orientations=orientations,
    )  # fmt: skip
    places, frames = human_frames(demonstration)
    toe = SMPLH.joint_names.index("R_Toe")
    foot = HUMAN_BODIES.index("right_foot")
    np.testing.assert_array_equal(places[:, foot], positions[:, toe])
    expected = rotations.multiply(orientations[:, toe], np.full(4, 0.5))
    np.testing.assert_allclose(angle(frames[:, foot], expected), 0, atol=1e-6)


def test_wrist_and_pelvis_are_the_joints_not_their_stand_ins():
    positions = np.random.default_rng(4).normal(size=(2, MOCAP.num_joints, 3))
    demonstration = Demonstration(
        "x", 30.0, MOCAP.joint_names, positions, MOCAP.keypoint_joints, 1.78
    )
    places, _ = human_frames(demonstration)
    for body, joint in (
        ("pelvis", "Hips"),
        ("left_wrist", "LeftHand"),
        ("left_elbow", "LeftForeArm"),
    ):
        i = MOCAP.joint_names.index(joint)
        np.testing.assert_array_equal(places[:, HUMAN_BODIES.index(body)], positions[:, i])
