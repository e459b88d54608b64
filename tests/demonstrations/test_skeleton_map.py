import numpy as np
import pytest

from omni_envs.demonstrations import SkeletonMap, read_skeleton_map, skeleton_names
from omni_envs.demonstrations.namings import NAMINGS, recognise, short_names, skeleton_map
from omni_envs.errors import FileFormatError, InvalidDataError, UnknownNameError
from omni_envs.robots import KEYPOINTS

JOINTS = {keypoint: f"j{i}" for i, keypoint in enumerate(KEYPOINTS)}


def write(folder, text, name="map.yaml"):
    (folder / name).write_text(text)
    return folder / name


def test_round_trip(tmp_path):
    full = SkeletonMap(
        "mine",
        JOINTS,
        head_top="top",
        contacts={"left_hand": ("j0", "j1")},
        joint_names=(*JOINTS.values(), "top"),
    )
    assert read_skeleton_map(write(tmp_path, full.to_yaml())) == full
    plain = SkeletonMap("plain", JOINTS)
    assert read_skeleton_map(write(tmp_path, plain.to_yaml())) == plain


def test_fitting_takes_what_lies_below_the_wrist():
    names = [*JOINTS.values(), "finger", "tip", "other"]
    parents = [-1, *[0] * 14, KEYPOINTS.index("left_hand"), 15, 0]
    skeleton = SkeletonMap("mine", JOINTS).fit("x", names, parents)
    hand = JOINTS["left_hand"]
    assert skeleton.contact_joints["left_hand"] == (hand, "finger", "tip")
    assert skeleton.contact_joints["right_foot"] == (JOINTS["right_toe"],)
    with pytest.raises(FileFormatError, match=r"x: joints: expected those.*no j3, j4 among"):
        SkeletonMap("mine", JOINTS).fit("x", [n for n in names if n not in ("j3", "j4")])


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"left_toe": None}, "keypoints must be a joint for each.*none for left_toe"),
        ({"left_toe": "j1"}, "15 different joints; got j1 twice"),
        ({"tail": "j99"}, "keys among pelvis"),
    ],
)
def test_incomplete_maps(change, match):
    table = {k: j for k, j in (JOINTS | change).items() if j is not None}
    with pytest.raises(InvalidDataError, match=match):
        SkeletonMap("mine", table)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "content: expected a table with name, keypoints"),
        ("[1, 2]", "content: expected a table"),
        ("joints: {}", "content: expected a table.*found 'joints'"),
        ("name: [", "content: expected YAML"),
        ("!!python/object/apply:os.system ['echo']", "content: expected YAML"),
        ("name: 3\nkeypoints: {}", "name: expected text"),
        ("keypoints: [a]", "keypoints: expected a table"),
        ("keypoints: {pelvis: [a]}", "keypoints: pelvis: expected a joint's name"),
        ("keypoints: {pelvis: a}", "keypoints: expected a valid skeleton map.*left_hip"),
        ("keypoints: {}\njoint_names: x", "joint_names: expected a list of names"),
        ("keypoints: {}\ncontacts: {left_hand: 3}", "contacts: left_hand: expected a list"),
        ("[" * 5000, "content: expected YAML"),
    ],
)
def test_bad_yaml(tmp_path, text, match):
    path = write(tmp_path, text)
    with pytest.raises(FileFormatError, match=match) as error:
        read_skeleton_map(path)
    assert "\n" not in str(error.value)


def test_large_and_missing_files(tmp_path):
    with pytest.raises(FileFormatError, match="existing YAML file"):
        read_skeleton_map(tmp_path / "absent.yaml")
    with pytest.raises(FileFormatError, match="at most 1 MiB"):
        read_skeleton_map(write(tmp_path, "#" * (1 << 21)))


@pytest.mark.parametrize("naming", NAMINGS, ids=lambda naming: naming.name)
def test_namings_recognise_themselves_and_no_other(naming):
    extra = [naming.hallmark] if naming.hallmark else []
    found = recognise([*naming.keypoints().values(), *extra])
    assert found is not None and found.name == naming.name
    assert found.keypoints == naming.keypoints()
    assert set(found.keypoints) == set(KEYPOINTS)
    assert naming.name in skeleton_names()
    assert recognise([*naming.keypoints().values(), *extra][1:]) is None
    for order in naming.orders:
        assert set(found.keypoints.values()) <= {*order} and len({*order}) == len(order)


def test_namespaces_and_shared_prefixes_are_dropped():
    assert short_names(["a:b:Hips", "a:Spine"]) == ["Hips", "Spine"]
    assert short_names(["Man_1_Hips", "Man_1_Head"]) == ["Hips", "Head"]
    assert short_names(["L_Hip", "L_Knee"]) == ["Hip", "Knee"]
    assert short_names(["a:Hips", "b:Hips"]) == ["a:Hips", "b:Hips"]  # two people
    assert short_names(["Hips"]) == ["Hips"] and short_names([]) == []


def test_a_skeleton_by_name(tmp_path):
    names = [*NAMINGS[0].keypoints().values()]
    assert skeleton_map("lafan1", names, tmp_path).name == "lafan1"
    assert skeleton_map("mocap", (), tmp_path).joint_names is not None
    with pytest.raises(UnknownNameError, match="Did you mean 'mixamo'"):
        skeleton_map("mixano", names, tmp_path)
    assert np.all([len(m) == 15 for m in (skeleton_map("smpl", (), tmp_path).keypoints,)])
