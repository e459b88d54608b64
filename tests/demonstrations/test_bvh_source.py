import warnings

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from omni_envs.demonstrations import (
    SourceOptions,
    load_bvh,
    load_demonstration,
    scale_demonstration,
    stance_intervals,
)
from omni_envs.errors import FileFormatError, InvalidOptionError, UnknownNameError
from omni_envs.robots import KEYPOINTS


def joint(demo, name):
    return demo.positions[:, demo.joint_names.index(name)]


def z_up(positions):
    return positions[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


def test_lafan1(person, write_bvh):
    """30 fps, cm, y up, ZYX rotations, bones along local x: zero rotations are no person."""
    who = person(place=(0.3, 0.35, -0.2))
    demo = load_demonstration(write_bvh(who, bones_along_x=True))
    truth = z_up(who.pose()[0]) - [0.0, 0.0, 0.35]  # the ground is where the toes stand
    assert demo.fps == 30 and demo.num_frames == who.frames
    assert demo.licence == "CC BY-NC-ND 4.0"
    for name, path in zip(who.names, np.moveaxis(truth, 1, 0), strict=True):
        np.testing.assert_allclose(joint(demo, name), path, atol=1e-5)
    assert demo.height == pytest.approx(0.85 / 0.491, rel=1e-4)
    assert demo.keypoint_joints["left_toe"] == "LeftToe"
    assert demo.contact_joints["left_hand"] == ("LeftHand", "LeftHandEnd")
    source = scale_demonstration(demo, 1.32)
    toes = source.keypoints[:, [KEYPOINTS.index(f"{s}_toe") for s in ("left", "right")], 2]
    np.testing.assert_allclose(toes[:, 1], 0.0, atol=1e-5)
    assert toes[45, 0] > 0.1
    left, right = source.stance["default"].T
    assert stance_intervals(right) == [(1, who.frames)]
    assert stance_intervals(left)[0][0] == 1 and 28 <= stance_intervals(left)[0][1] <= 33


def mixamo(name):
    return "mixamorig:" + name.replace("Toe", "ToeBase")


def cmu(name):
    return name.replace("Toe", "ToeBase").replace("Spine2", "LHipJoint")


def daz(name):
    table = {"Hips": "hip", "Spine": "abdomen", "Neck": "neck", "Head": "head"}
    for title, s in (("Left", "l"), ("Right", "r")):
        parts = ("UpLeg Thigh,Leg Shin,Foot Foot,Shoulder Collar,Arm Shldr,ForeArm ForeArm,"
                 "Hand Hand")  # fmt: skip
        table |= {title + a: s + b for a, b in (pair.split() for pair in parts.split(","))}
    return table.get(name, name)


def xsens(name):
    for ours, theirs in (
        ("UpLeg", "Hip"), ("ForeArm", "Elbow"), ("Leg", "Knee"), ("Foot", "Ankle"),
        ("Shoulder", "Collar"), ("Arm", "Shoulder"), ("Hand", "Wrist"),
    ):  # fmt: skip
        if name.startswith(("Left", "Right")) and name.endswith(ours):
            return name.replace(ours, theirs)
    return name


def rokoko(name):
    return name.replace("UpLeg", "Thigh").replace("Leg", "Shin")


def bandai(name):
    for title, s in (("Left", "_L"), ("Right", "_R")):
        for ours, theirs in (
            ("UpLeg", "UpperLeg"), ("Leg", "LowerLeg"), ("Foot", "Foot"), ("Toe", "Toes"),
            ("Arm", "UpperArm"), ("ForeArm", "LowerArm"), ("Hand", "Hand"),
        ):  # fmt: skip
            if name == title + ours:
                return theirs + s
    return name


@pytest.mark.parametrize(
    ("rename", "how", "source"),
    [
        (mixamo, {"unit": 0.01, "order": "ZXY"}, "BVH"),
        (mixamo, {"unit": 1.0, "order": "YXZ", "z_up": True}, "BVH"),
        (mixamo, {"unit": 1.0, "order": "XYZ", "z_up": True, "rest_y_up": True}, "BVH"),
        (cmu, {"unit": 0.0254 / 0.45, "order": "ZYX"}, "CMU"),
        (daz, {"order": "ZXY", "skip": ("LeftToe", "RightToe")}, "CMU"),
        (xsens, {"order": "YXZ"}, "BVH"),
        (rokoko, {"unit": 0.001, "order": "ZXY"}, "BVH"),
        (bandai, {"unit": 0.0254, "order": "XYZ"}, "Bandai"),
        (lambda n: "Character1_" + n.replace("Toe", "ToeBase"), {"order": "XYZ"}, "BVH"),
    ],
)
def test_every_naming_gives_the_same_keypoints(person, write_bvh, rename, how, source):
    who = person(fps=60.0)
    demo = load_demonstration(write_bvh(who, rename=rename, **how))
    assert demo.fps == 30 and demo.num_frames == 61 and source in demo.source
    expected = load_demonstration(write_bvh(who, "lafan1.bvh"))
    np.testing.assert_allclose(demo.keypoints, expected.keypoints, atol=1e-4)
    assert demo.height == pytest.approx(expected.height, rel=0.06)


def test_height_is_measured_where_the_rest_skeleton_ends_at_the_crown(person, write_bvh):
    def accad(name):
        return name.replace("Toe", "ToeBase").replace("Spine2", "ToSpine")

    demo = load_bvh(write_bvh(person(), rename=accad))
    assert "ACCAD" in demo.source
    # Ankle to crown, the ankle's own height and the scalp.
    crown = 0.02 + 0.43 + 0.42 + 0.1 + 0.12 + 0.12 + 0.2 + 0.1 + 0.2
    assert demo.height == pytest.approx(crown + 0.09, abs=1e-5)
    assert load_bvh(write_bvh(person(), rename=accad), SourceOptions(height=1.6)).height == 1.6


def test_part_of_a_file(person, write_bvh):
    path = write_bvh(person(fps=120.0))
    whole = load_demonstration(path)
    part = load_demonstration(path, start=0.5, end=1.5)
    assert whole.num_frames == 61 and part.num_frames == 30
    np.testing.assert_allclose(part.positions, whole.positions[15:45], atol=1e-9)
    tail = load_demonstration(path, start=1.5)
    np.testing.assert_allclose(tail.positions, whole.positions[45:], atol=1e-9)
    with pytest.raises(FileFormatError, match=r"clip\.bvh: start, end: expected .*2\.0"):
        load_demonstration(path, start=3.0)


def test_the_user_may_know_better(person, write_bvh, tmp_path):
    who = person()
    path = write_bvh(who)
    assert load_demonstration(path, fps=60.0).num_frames == 31
    child = write_bvh(who, "child.bvh", unit=0.024)  # 35 cm of leg would be 89 cm in inches
    assert load_demonstration(child).height == pytest.approx(1.83, abs=0.01)
    assert load_demonstration(child, unit="cm").height == pytest.approx(0.72, abs=0.01)
    on_its_side = load_demonstration(path, up="z")
    np.testing.assert_allclose(np.ptp(on_its_side.positions[0], axis=0)[1] > 1.2, True)
    skeleton = tmp_path / "map.yaml"
    keypoints = load_demonstration(path).keypoint_joints
    lines = [f"  {k}: Odd{j}" for k, j in keypoints.items()]
    skeleton.write_text("keypoints:\n" + "\n".join(lines))
    odd = write_bvh(
        who, "odd.bvh", rename=lambda name: f"Odd{name}" if name != "Hips" else "OddHips"
    )
    with pytest.raises(FileFormatError, match=r"omni-envs skeleton odd\.bvh"):
        load_demonstration(write_bvh(who, "odd.bvh", rename=lambda n: f"Odd{n[::-1]}"))
    odd = write_bvh(who, "odd.bvh", rename=lambda n: f"Odd{n}")
    np.testing.assert_allclose(
        load_demonstration(odd, skeleton=skeleton).keypoints, load_demonstration(path).keypoints
    )
    with pytest.raises(FileFormatError, match=r"clip\.bvh: joints.*OddHips"):
        load_demonstration(path, skeleton=skeleton)
    with pytest.raises(UnknownNameError, match="lafan1"):
        load_demonstration(path, skeleton="lafan2")
    with pytest.raises(FileFormatError, match="the naming 'xsens'"):
        load_demonstration(path, skeleton="xsens")


@pytest.mark.parametrize(
    ("how", "match"),
    [
        ({"unit": 0.1}, r"unit of length: expected thigh and shin of .*option unit; found 8\.5"),
        ({"root_unit": 1.0}, "root position: expected positions and OFFSETs in one unit"),
        ({"unit": 1.0, "root_unit": 0.01}, "root position: expected positions and OFFSETs"),
        ({"rename": lambda n: n.replace("LeftToe", "LeftTow")}, "joints: expected a known naming"),
        (
            {"rename": lambda n: {"LeftArm": "RightArm", "RightArm": "Other"}.get(n, n)},
            "joints: expected a known naming",
        ),
        ({"rename": lambda n: n.replace("LeftLeg", "RightLeg")}, "names that differ.*RightLeg"),
        (
            {"rename": lambda n: n.replace("Left", "?").replace("Right", "Left")
             .replace("?", "Right")},
            "left and right.*backwards on 100 %",
        ),
    ],
)  # fmt: skip
def test_inhuman_files(person, write_bvh, how, match):
    who = person()
    who.root = who.root + np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 0.1], who.frames)
    path = write_bvh(who, **how)
    with pytest.raises(FileFormatError, match=match) as error:
        load_demonstration(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_a_height_that_does_not_fit_the_legs_is_told(person, write_bvh):
    path = write_bvh(person())
    with pytest.warns(UserWarning, match=r"clip\.bvh: a height of 2\.6 m does not fit thighs"):
        assert load_demonstration(path, height=2.6).height == 2.6
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        usual = load_demonstration(path).height
        load_demonstration(path, height=1.2 * usual)


@pytest.mark.parametrize(("frame_time", "fps"), [("8.3333", "0.12"), ("0.0001", "10000")])
def test_absurd_frame_rates(person, write_bvh, frame_time, fps):
    path = write_bvh(person())
    path.write_text(path.read_text().replace("Frame Time: 0.033333", f"Frame Time: {frame_time}"))
    with pytest.raises(
        FileFormatError, match=f"Frame Time.*option fps .--fps-source.; found {fps}"
    ):
        load_demonstration(path)
    assert load_demonstration(path, fps=30.0).num_frames == 61


@pytest.mark.parametrize(
    "options",
    [{"up": "w"}, {"unit": "km"}, {"fps": 0.0}, {"start": -1.0}, {"start": 2.0, "end": 1.0}],
)
def test_options_with_impossible_values(person, write_bvh, options):
    with pytest.raises(InvalidOptionError, match=next(iter(options))):
        load_demonstration(write_bvh(person()), **options)


@pytest.mark.parametrize(
    "clip", ["B03_Walk1", "B09_WalkTurnLeft90", "A11_CrawlForward", "A06_LiftBox"]
)
def test_recorded_accad_clips(shared, clip):
    demo = load_demonstration(shared / f"data/accad/Female1_{clip}.bvh")
    assert demo.fps == 30 and 1.6 < demo.height < 1.75
    # Not mirrored: forward, from the left hip and the spine, is where the toes point.
    across = joint(demo, "LeftUpLeg") - joint(demo, "RightUpLeg")
    forward = np.cross(across, joint(demo, "Neck") - joint(demo, "Hips"))
    toes = joint(demo, "LeftToeBase") - joint(demo, "LeftFoot")
    assert np.mean(np.sum(forward * toes, axis=1) > 0) > 0.99
    source = scale_demonstration(demo, 1.32)
    pelvis = source.keypoints[:, 0, 2]
    if "Crawl" in clip:
        assert pelvis.min() > 0.05 and pelvis.max() < 0.3
        assert source.contacts["right_knee"].any()
        knees = source.keypoints[:, [KEYPOINTS.index(f"{s}_knee") for s in ("left", "right")], 2]
        # But for a third of a second, knees come no lower than their radius.
        lower = np.sort(knees.min(axis=1))
        assert lower[10] == pytest.approx(0.04 * source.scale) and lower[0] > 0.02
    if "Walk" in clip:
        assert pelvis.min() > 0.65 and pelvis.max() < 0.8
        for foot, name in enumerate(("left_toe", "right_toe")):
            height = source.keypoints[:, KEYPOINTS.index(name), 2]
            standing = [
                height[a:b].mean() for a, b in stance_intervals(source.stance["default"][:, foot])
            ]
            assert np.ptp(standing) < 0.03  # the recorded floor rises by 8 cm on the way


def test_recorded_cmu_jumps_with_daz_names(shared):
    demo = load_demonstration(shared / "data/cmu/01_01.bvh")
    assert demo.fps == 30 and demo.num_frames == 688 and 1.6 < demo.height < 1.75
    assert demo.keypoint_joints["left_toe"] == "lFootEnd"
    assert "lThumb2" in demo.contact_joints["left_hand"]
    source = scale_demonstration(demo, 1.32)
    pelvis = source.keypoints[:, 0, 2]
    assert pelvis.min() > 0.3 and 0.8 < pelvis.max() < 1.0  # crouches and jumps
    toes = source.keypoints[:, [KEYPOINTS.index(f"{s}_toe") for s in ("left", "right")], 2]
    assert toes.max() > 0.2
    assert np.median(toes[source.stance["default"]]) < 0.04


def test_terrain_stands_where_the_file_has_it(person, write_bvh, tmp_path):
    """With terrain the ground is z = 0 of the file, tilt and all."""
    who = person(place=(0.3, 0.35, -0.2))
    box = trimesh.creation.box(extents=[1, 1, 0.35]).apply_translation([0, 0, 0.175])
    box.export(tmp_path / "step.obj")
    demo = load_demonstration(write_bvh(who), terrain_mesh=tmp_path / "step.obj")
    assert joint(demo, "RightToe")[0, 2] == pytest.approx(0.35, abs=1e-6)
    (part,) = demo.scene.terrain.parts
    np.testing.assert_allclose(part.shape.half_extents, (0.5, 0.5, 0.175), atol=1e-6)


def test_stretched_feet_point_neither_way(person, write_bvh):
    """Someone on the knees is not taken for mirrored."""
    who = person()
    for side in ("Left", "Right"):
        who.local[f"{side}Foot"] = Rotation.from_rotvec(np.tile([1.3, 0.0, 0.0], (who.frames, 1)))
    assert load_demonstration(write_bvh(who)).num_frames == 61


@pytest.mark.parametrize("fps", [24.0, 25.0, 29.97, 50.0, 59.94, 90.0, 119.88])
def test_every_rate_becomes_30(person, write_bvh, fps):
    demo = load_demonstration(write_bvh(person(fps=fps)))
    assert demo.fps == 30 and abs(demo.num_frames - 61) <= 1
    slow = load_demonstration(write_bvh(person(fps=30.0)))
    frames = min(demo.num_frames, slow.num_frames)
    np.testing.assert_allclose(demo.keypoints[:frames], slow.keypoints[:frames], atol=4e-3)


def test_a_single_frame(person, write_bvh):
    demo = load_demonstration(write_bvh(person(seconds=0.0)))
    assert demo.num_frames == 1 and scale_demonstration(demo, 1.32).num_frames == 1
