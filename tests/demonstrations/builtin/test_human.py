import numpy as np
import pytest

from omni_envs.demonstrations.builtin import human
from omni_envs.robots import CONTACT_LINKS, KEYPOINTS


def every_frame(values, frames=3):
    return np.broadcast_to(np.asarray(values, float), (frames, *np.shape(values)))


def standing():
    zero, flat = every_frame(np.zeros(3)), every_frame(np.zeros(2))
    joints = human.torso(every_frame([0.0, 0.0, 0.92]), zero, zero, zero, np.zeros(3))
    toes = every_frame([[0.05, 0.095, 0.02], [0.05, -0.095, 0.02]])
    human.add_legs(joints, human.Feet(toes, flat, flat, flat), np.zeros(3))
    hands = human.Hands(
        wrists=every_frame([[0.1, 0.2, 0.9], [0.1, -0.2, 0.9]]),
        fingers=every_frame([[0.0, 0.0, -1.0]] * 2),
        palms=every_frame([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]),
        poles=every_frame([[-1.0, 0.0, 0.0]] * 2),
    )
    human.add_arms(joints, hands)
    return joints


def test_every_joint_is_posed_and_symmetric():
    joints = standing()
    assert set(joints) == set(human.JOINTS)
    for name in human.JOINTS:
        if name.startswith("L_"):
            mirrored = joints["R" + name[1:]] * [1, -1, 1]
            np.testing.assert_allclose(joints[name], mirrored, atol=1e-12)


def test_segments_keep_their_length_and_bend_the_right_way():
    joints = standing()

    def length(a, b):
        return np.linalg.norm(joints[a] - joints[b], axis=-1)

    np.testing.assert_allclose(length("L_Hip", "L_Knee"), human.THIGH)
    np.testing.assert_allclose(length("L_Knee", "L_Ankle"), human.SHIN)
    np.testing.assert_allclose(length("R_Shoulder", "R_Elbow"), human.UPPER_ARM)
    np.testing.assert_allclose(length("R_Elbow", "R_Wrist"), human.FOREARM)
    for start, middle, stop, sign in (
        ("Hip", "Knee", "Ankle", 1),
        ("Shoulder", "Elbow", "Wrist", -1),
    ):
        straight = 0.5 * (joints[f"L_{start}"] + joints[f"L_{stop}"])
        assert (sign * (joints[f"L_{middle}"] - straight)[:, 0] > 0.02).all()


def test_proportions():
    joints = standing()
    assert joints["Head"][0, 2] + 0.19 == pytest.approx(human.HEIGHT, abs=0.02)
    com = human.centre_of_mass(joints)
    assert 0.53 < com[0, 2] / human.HEIGHT < 0.60
    np.testing.assert_allclose(com[:, 1], 0.0, atol=1e-12)


def test_turn_leans_forward_and_turns_left():
    np.testing.assert_allclose(human.turn(0.0, np.pi / 2) @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(human.turn(np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(human.turn(0, 0, np.pi / 2) @ [0, 1, 0], [0, 0, 1], atol=1e-12)


def test_two_links_out_of_reach_stay_on_the_line():
    middle = human.two_links(
        np.zeros(3), np.array([3.0, 0, 0]), (1.0, 1.0), np.array([0.0, 0.0, 1.0])
    )
    np.testing.assert_allclose(middle, [1.0, 0, 0], atol=1e-9)


def test_skeleton():
    assert set(human.SKELETON.keypoint_joints) == set(KEYPOINTS)
    assert set(human.SKELETON.contact_joints) == set(CONTACT_LINKS)
