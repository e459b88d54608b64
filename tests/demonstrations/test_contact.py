from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import (
    MOCAP,
    Demonstration,
    object_contacts,
    scale_demonstration,
    terrain_contacts,
)
from omni_envs.scenes import Box, HeightField, Part, Scene, Terrain


def test_distance_decides_without_flags(pushed_box):
    contacts, points = object_contacts(pushed_box)
    assert contacts["left_hand"].tolist() == [False, False, True, True]
    assert not contacts["right_hand"].any()
    # The box sits at (1, 0, 0.2): its face x = −0.2 is touched at its middle.
    np.testing.assert_allclose(points["left_hand"][2], [-0.2, 0, 0], atol=1e-12)
    assert np.isnan(points["left_hand"][:2]).all() and np.isnan(points["right_hand"]).all()


def test_flags_win_over_distance(pushed_box):
    flags = np.array([True, False, False, True])
    contacts, points = object_contacts(replace(pushed_box, contacts={"left_hand": flags}))
    np.testing.assert_array_equal(contacts["left_hand"], flags)
    assert np.isfinite(points["left_hand"][0]).all() and np.isnan(points["left_hand"][2]).all()


def test_points_are_in_the_turned_object_frame(pushed_box):
    turned = pushed_box.object_poses.copy()
    turned[:, 3:] = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]
    _, points = object_contacts(replace(pushed_box, object_poses=turned))
    # What lies towards −x in the world lies towards +y in a frame turned by 90°.
    np.testing.assert_allclose(points["left_hand"][3], [0, 0.2, 0], atol=1e-12)


def standing(terrain=None):
    positions = np.full((3, MOCAP.num_joints, 3), 1.0)
    return Demonstration(
        name="stand",
        fps=30.0,
        joint_names=MOCAP.joint_names,
        positions=positions,
        keypoint_joints=MOCAP.keypoint_joints,
        height=1.78,
        scene=Scene(terrain=terrain),
        contact_joints=MOCAP.contact_joints,
    )


@pytest.mark.parametrize(
    ("joint", "link", "height", "touches"),
    [
        ("LeftHandIndex2", "left_hand", 0.019, True),
        ("LeftHandIndex2", "left_hand", 0.021, False),
        ("RightLeg", "right_knee", 0.059, True),  # the joint lies 4 cm inside the knee
        ("RightLeg", "right_knee", 0.061, False),
    ],
)
def test_hands_and_knees_touch_the_ground(joint, link, height, touches):
    demo = standing()
    demo.positions[1, MOCAP.joint_names.index(joint)] = [0.3, 0.4, height]
    contacts, points = terrain_contacts(demo, demo.positions, None, 1.0)
    assert contacts[link].tolist() == [False, touches, False]
    if touches:
        np.testing.assert_allclose(points[link][1], [0.3, 0.4, 0.0])


def test_feet_touch_terrain_but_not_the_ground():
    terrain = Terrain((Part(Box((1, 1, 0.25)), (5, 0, 0.25)),))
    demo = standing()
    toe = MOCAP.joint_names.index("LeftToeBase")
    demo.positions[0, toe] = [0, 0, 0.0]
    demo.positions[1, toe] = [5, 0, 0.51]
    contacts, points = terrain_contacts(demo, demo.positions, terrain, 1.0)
    assert contacts["left_foot"].tolist() == [False, True, False]
    np.testing.assert_allclose(points["left_foot"][1], [5, 0, 0.5])


def test_terrain_is_judged_at_robot_scale():
    demo = standing(Terrain((Part(Box((1, 1, 0.25)), (5, 0, 0.25)),)))
    joints = demo.joint_names
    demo.positions[:, [joints.index("LeftToeBase"), joints.index("RightToeBase")], 2] = 0.0
    # 3 cm over the block at human scale is 1.5 cm at half scale.
    demo.positions[:, joints.index("LeftHand")] = [5, 0, 0.53]
    source = scale_demonstration(demo, 0.89)
    assert source.contacts["left_hand"].all()
    np.testing.assert_allclose(source.contact_points["left_hand"][0], [2.5, 0, 0.25], atol=1e-9)


def test_uneven_ground_is_touched_like_any_other():
    demo = standing()
    field = HeightField(np.full((5, 5), 0.3), (2.0, 2.0), (5.0, 0.0))
    toe = MOCAP.joint_names.index("LeftToeBase")
    demo.positions[0, toe] = [5, 0, 0.33]
    demo.positions[1, toe] = [5, 0, 0.31]
    contacts, points = terrain_contacts(demo, demo.positions, Terrain((), field), 1.0)
    assert contacts["left_foot"].tolist() == [False, True, False]
    np.testing.assert_allclose(points["left_foot"][1], [5, 0, 0.3], atol=1e-9)


def test_the_middle_of_the_patch_is_touched():
    demo = standing()
    for finger, x, z in (("Index2", 0.3, 0.0), ("Ring2", 0.4, 0.0), ("Pinky2", 0.9, 0.019)):
        demo.positions[1, MOCAP.joint_names.index(f"LeftHand{finger}")] = [x, 0.0, z]
    _, points = terrain_contacts(demo, demo.positions, None, 1.0)
    # The little finger is 19 of 20 mm further off: it counts a twentieth.
    np.testing.assert_allclose(points["left_hand"][1], [(0.7 + 0.05 * 0.9) / 2.05, 0, 0])


def test_a_hand_inside_a_thin_plate_leaves_on_the_side_of_the_elbow():
    plate = Terrain((Part(Box((1, 1, 0.05)), (0, 0, 1.0)),))
    for elbow, z in ((1.5, 1.05), (0.5, 0.95)):
        demo = standing()
        demo.positions[..., :] = [5.0, 5.0, 5.0]
        names = MOCAP.joint_names
        demo.positions[1, names.index("LeftForeArm")] = [0, 0, elbow]
        demo.positions[1, names.index("LeftHandIndex2")] = [0, 0, 0.99]  # nearer to the lower face
        contacts, points = terrain_contacts(demo, demo.positions, plate, 1.0)
        assert contacts["left_hand"].tolist() == [False, True, False]
        np.testing.assert_allclose(points["left_hand"][1], [0, 0, z])
