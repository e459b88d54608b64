import numpy as np
import pytest

from omni_envs.demonstrations import (
    builtin_demonstration,
    closest_points,
    stance_intervals,
)
from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.climb import climb
from omni_envs.demonstrations.builtin.climb_plan import PLATFORM

DT = 1 / 30


@pytest.fixture(scope="module")
def demo():
    return builtin_demonstration("climb")


def norm(v):
    return np.linalg.norm(v, axis=-1)


def test_platform_is_seven_tenths_of_the_height(demo, source):
    assert pytest.approx(0.7) == PLATFORM / human.HEIGHT
    assert demo.scene.terrain.surface().bounds[1, 2] == pytest.approx(PLATFORM)
    assert source.scene.terrain.surface().bounds[1, 2] == pytest.approx(0.7 * 1.32)


def test_made_the_same_and_once(demo):
    climb.cache_clear()
    again = builtin_demonstration("climb")
    np.testing.assert_array_equal(again.positions, demo.positions)
    assert builtin_demonstration("climb") is again
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
            np.testing.assert_allclose(measured, length, atol=2e-4)


def test_gets_up_and_down_again(demo, joint):
    toes, head = joint["L_Toe"], joint["Head"]
    for frame, ground in ((0, 0.0), (demo.num_frames // 2, PLATFORM), (-1, 0.0)):
        for side in "LR":
            assert joint[f"{side}_Toe"][frame, 2] - ground == pytest.approx(0.02, abs=1e-6)
        assert head[frame, 2] - ground > 1.4
        upright = joint["Neck"][frame] - joint["Pelvis"][frame]
        assert upright[2] > 0.98 * norm(upright)
    assert toes[0, 0] < -0.3 and toes[demo.num_frames // 2, 0] > 0.3


def test_order_of_contacts_on_the_way_up(source):
    top = source.scene.terrain.surface().bounds[1, 2]

    def first(link):
        # The right knee brushes the wall while the leg pushes.
        up = source.contact_points[link][:, 2] > (0.9 * top if link.endswith("knee") else 0.0)
        return int(np.argmax(up))

    hands = max(first("left_hand"), first("right_hand"))
    assert hands < first("right_foot") < first("left_knee") < first("right_knee")
    # The hands stay on top from before the foot takes the wall until both knees are up.
    both = source.contacts["left_hand"] & source.contacts["right_hand"]
    assert both[hands : first("left_knee")].all()


def test_what_is_planted_is_still(demo, joint, source):
    """Hands on top, feet on wall, ground and top, knees: no sliding while they touch."""
    for name in ("L_Palm", "R_Palm", "L_Toe", "R_Toe"):
        speed = norm(np.gradient(joint[name], DT, axis=0))
        assert 0.3 < (speed < 1e-6).mean() < 0.9
    for side, link in (("L", "left_knee"), ("R", "right_knee")):
        speed = norm(np.gradient(joint[f"{side}_Knee"], DT, axis=0))
        rests = stance_intervals(source.contacts[link] & (speed < 0.05))
        assert sum(b - a for a, b in rests) * DT > 4.0


def test_motion_is_smooth(demo):
    velocity = np.diff(demo.positions, axis=0) / DT
    acceleration = np.diff(velocity, axis=0) / DT
    trunk = [demo.joint_names.index(n) for n in ("Pelvis", "Chest", "Head")]
    assert norm(velocity[:, trunk]).max() < 1.5 and norm(velocity).max() < 3.3
    assert norm(acceleration[:, trunk]).max() < 45 and norm(acceleration).max() < 60


def test_body_keeps_out_of_the_platform(demo, joint):
    parts = demo.scene.terrain.parts
    for side in "LR":
        for a, b in (("Hip", "Knee"), ("Knee", "Ankle"), ("Ankle", "Toe"), ("Elbow", "Wrist")):
            weight = np.linspace(0, 1, 9)[:, None, None]
            points = (1 - weight) * joint[f"{side}_{a}"] + weight * joint[f"{side}_{b}"]
            assert closest_points(parts, points.reshape(-1, 3))[1].min() > 0.0
    assert closest_points(parts, joint["Pelvis"])[1].min() > 0.05
    for name in demo.joint_names:
        assert joint[name][:, 2].min() > -1e-6
