import pytest

from omni_envs.robots.robot import CONTACT_LINKS, Actuator
from omni_envs.robots.tables import Drive, both, contact_links, limb, same, sided

DRIVE = Drive(effort=10.0, speed=5.0, stiffness=100.0, damping=2.0, armature=0.1)


@pytest.mark.parametrize(
    ("pattern", "left", "right"),
    [
        ("{side}_knee", "left_knee", "right_knee"),
        ("{Side}_Knee", "Left_Knee", "Right_Knee"),
        ("A{S}1", "AL1", "AR1"),
        ("torso", "torso", "torso"),
    ],
)
def test_names_of_a_side(pattern, left, right):
    assert (sided(pattern, "left"), sided(pattern, "right")) == (left, right)


def test_both_sides_left_first():
    assert both("{side}_hip", "{S}_toe") == ("left_hip", "L_toe", "right_hip", "R_toe")
    assert list(same("{side}_{joint}", hip=0.1, knee=-0.2).items()) == [
        ("left_hip", 0.1), ("left_knee", -0.2), ("right_hip", 0.1), ("right_knee", -0.2),
    ]  # fmt: skip


def test_a_limb_keeps_the_order_of_its_drives():
    knee, hip = limb("{Side}_{joint}_joint", "right", {"knee": DRIVE, "hip": DRIVE})
    assert knee == Actuator("Right_knee_joint", 100.0, 2.0, 10.0, 5.0, 0.1)
    assert hip.joint == "Right_hip_joint"


def test_contact_links_are_those_of_every_robot():
    links = contact_links(hand="{side}_palm", foot="{S}_sole", knee="{side}_shin")
    assert set(links) == set(CONTACT_LINKS)
    assert links["right_foot"] == ("R_sole",)
