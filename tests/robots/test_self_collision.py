from dataclasses import replace

from omni_envs.robots import G1
from omni_envs.robots.self_collision import resting_pairs


def test_pairs_are_bodies_of_the_robot_in_model_order():
    for first, second in resting_pairs(G1):
        assert G1.body_names.index(first) < G1.body_names.index(second)


def test_hands_and_legs_are_never_excused():
    assert not any("wrist" in pair[0] + pair[1] for pair in resting_pairs(G1))


def test_bodies_that_touch_at_rest_are_found():
    # Arms pressed against the body by the default pose count as neighbours.
    joints = {**G1.default_joint_positions, "left_shoulder_roll_joint": -0.3}
    pressed = replace(G1, name="pressed", default_joint_positions=joints)
    more = resting_pairs(pressed) - resting_pairs(G1)
    assert any("left" in first + second for first, second in more)
