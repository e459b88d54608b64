import pytest

from omni_envs.demonstrations import MOCAP, SMPLH
from omni_envs.demonstrations.skeleton import Skeleton
from omni_envs.errors import InvalidDataError
from omni_envs.robots import CONTACT_LINKS, KEYPOINTS


@pytest.mark.parametrize(("skeleton", "joints"), [(SMPLH, 52), (MOCAP, 53)])
def test_skeletons_name_every_keypoint_and_link_once(skeleton, joints):
    assert skeleton.num_joints == len(set(skeleton.joint_names)) == joints
    assert set(skeleton.keypoint_joints) == set(KEYPOINTS)
    assert len(set(skeleton.keypoint_joints.values())) == len(KEYPOINTS)
    assert set(skeleton.contact_joints) == set(CONTACT_LINKS)
    for name, joint in skeleton.keypoint_joints.items():
        assert name == "pelvis" or joint[0] == name[0].upper()


def test_smplh_is_in_intermimic_order():
    names = SMPLH.joint_names
    assert names[:9] == (
        *("Pelvis", "L_Hip", "L_Knee", "L_Ankle", "L_Toe"),
        *("R_Hip", "R_Knee", "R_Ankle", "R_Toe"),
    )
    assert names[17:21] == ("L_Wrist", "L_Index1", "L_Index2", "L_Index3")
    assert names[33:38] == ("R_Thorax", "R_Shoulder", "R_Elbow", "R_Wrist", "R_Index1")
    assert names[-1] == "R_Thumb3"


def test_mocap_order():
    names = MOCAP.joint_names
    assert names[8:12] == ("LeftHand", "LeftHandThumb1", "LeftHandThumb2", "LeftHandThumb3")
    assert names[43:47] == ("LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase")
    assert names[-2:] == ("LeftFootMod", "RightFootMod")


def test_a_joint_that_does_not_exist_is_refused():
    with pytest.raises(InvalidDataError, match="Wing"):
        Skeleton("bird", SMPLH.joint_names, {**SMPLH.keypoint_joints, "left_hand": "Wing"})
    with pytest.raises(InvalidDataError, match="pelvis"):
        Skeleton("bird", SMPLH.joint_names, {})
