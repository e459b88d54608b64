import numpy as np
import pytest

from omni_envs.demonstrations import (
    builtin_demonstration,
    closest_points,
    stance_intervals,
)
from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.crawl import crawl
from omni_envs.demonstrations.builtin.crawl_plan import ANGLE, BLOCK, TOP, height

DT = 1 / 30


@pytest.fixture(scope="module")
def demo():
    return builtin_demonstration("crawl")


def norm(v):
    return np.linalg.norm(v, axis=-1)


def test_scene_is_a_slope_onto_a_block(demo):
    assert len(demo.scene.terrain.parts) == 2
    assert demo.scene.terrain.surface().bounds[1, 2] == pytest.approx(BLOCK)
    for x, expected in ((-0.1, 0.0), (0.5, 0.5 * np.tan(ANGLE)), (TOP, BLOCK), (TOP + 1, BLOCK)):
        assert height(x) == pytest.approx(expected)


def test_made_the_same_and_once(demo):
    crawl.cache_clear()
    again = builtin_demonstration("crawl")
    np.testing.assert_array_equal(again.positions, demo.positions)
    with pytest.raises(ValueError, match="read-only"):
        again.positions[0] = 0


def test_bones_are_rigid_and_limbs_within_reach(joint):
    for side in "LR":
        for a, b, length in (
            ("Hip", "Knee", human.THIGH),
            ("Knee", "Ankle", human.SHIN),
            ("Shoulder", "Elbow", human.UPPER_ARM),
            ("Elbow", "Wrist", human.FOREARM),
        ):
            measured = norm(joint[f"{side}_{a}"] - joint[f"{side}_{b}"])
            np.testing.assert_allclose(measured, length, atol=5e-3)


def test_from_the_ground_to_standing_on_the_block(joint):
    for frame, ground in ((0, 0.0), (-1, BLOCK)):
        for side in "LR":
            assert joint[f"{side}_Toe"][frame, 2] - ground == pytest.approx(0.02, abs=1e-6)
        assert joint["Head"][frame, 2] - ground > 1.4
    # The last place is all on the block.
    assert joint["L_Heel"][-1, 0] > TOP and joint["R_Heel"][-1, 0] > TOP


def test_crawls_in_diagonal_pairs_on_hands_and_knees(joint, source):
    crawling = slice(round(4.5 / DT), round(12.5 / DT))
    for link in ("left_hand", "right_hand", "left_knee", "right_knee"):
        share = source.contacts[link][crawling].mean()
        assert share > 0.5, link
    # The trunk stays level with the ground and the head looks ahead.
    back = (joint["Neck"] - joint["Pelvis"])[crawling]
    assert (np.degrees(np.arctan2(back[:, 2], back[:, 0])) < 35).all()
    speed = {n: norm(np.gradient(joint[n], DT, axis=0))[crawling] for n in joint}
    moving = {n: speed[n] > 0.3 for n in ("L_Knee", "R_Knee", "L_Palm", "R_Palm")}
    together = (moving["L_Knee"] & moving["R_Palm"]) | (moving["R_Knee"] & moving["L_Palm"])
    crossed = (moving["L_Knee"] & moving["L_Palm"]) | (moving["R_Knee"] & moving["R_Palm"])
    assert together.mean() > 0.3 and crossed.mean() < 0.02
    assert not (moving["L_Knee"] & moving["R_Knee"]).any()


def test_what_is_planted_is_still(joint):
    for name in ("L_Palm", "R_Palm", "L_Toe", "R_Toe"):
        speed = norm(np.gradient(joint[name], DT, axis=0))
        rests = [b - a for a, b in stance_intervals(speed < 1e-6)]
        assert len(rests) >= 6 and sum(rests) * DT > 4.0, name


def test_motion_is_smooth(demo):
    velocity = np.diff(demo.positions, axis=0) / DT
    acceleration = np.diff(velocity, axis=0) / DT
    trunk = [demo.joint_names.index(n) for n in ("Pelvis", "Chest", "Head")]
    assert norm(velocity[:, trunk]).max() < 1.8 and norm(velocity).max() < 3.3
    assert norm(acceleration[:, trunk]).max() < 45 and norm(acceleration).max() < 60


def test_body_keeps_out_of_the_slope(demo, joint):
    parts = demo.scene.terrain.parts
    for side in "LR":
        for a, b in (("Hip", "Knee"), ("Knee", "Ankle"), ("Ankle", "Toe"), ("Elbow", "Wrist")):
            weight = np.linspace(0, 1, 9)[:, None, None]
            points = (1 - weight) * joint[f"{side}_{a}"] + weight * joint[f"{side}_{b}"]
            assert closest_points(parts, points.reshape(-1, 3))[1].min() > 0.0
    for name in demo.joint_names:
        assert joint[name][:, 2].min() > -1e-6
