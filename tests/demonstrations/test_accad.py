import numpy as np
import pytest

from omni_envs.demonstrations import (
    ACCAD,
    load_accad,
    load_demonstration,
    scale_demonstration,
    stance_intervals,
)
from omni_envs.errors import FileFormatError
from omni_envs.robots import KEYPOINTS


def bvh(scale=1.0, z_up=False, frame_time=1 / 120, frames=9):
    """A rest-pose person in the ACCAD skeleton who slides forward (along +z with y up)."""

    def vector(v):
        x, y, z = (scale * c for c in v)
        return f"{x} {-z} {y}" if z_up else f"{x} {y} {z}"

    def joint(name, offset, *children):
        inside = "".join(children)
        return f"JOINT {name}\n{{\nOFFSET {vector(offset)}\n{rotations}{inside}}}\n"

    def end(offset):
        return f"End Site\n{{\nOFFSET {vector(offset)}\n}}\n"

    rotations = "CHANNELS 3 Zrotation Xrotation Yrotation\n"
    arms, legs = [], []
    for side, s in (("Left", 1), ("Right", -1)):
        hand = joint(f"{side}Hand", (23 * s, 0, 0), end((10 * s, 0, 0)))
        fore = joint(f"{side}ForeArm", (20 * s, 0, 0), hand)
        arms.append(
            joint(f"{side}Shoulder", (5 * s, 20, 0), joint(f"{side}Arm", (12 * s, 0, 0), fore))
        )
        toe = joint(f"{side}ToeBase", (0, -6, 12), end((0, 0, 6)))
        foot = joint(f"{side}Foot", (0, -40, 0), toe)
        legs.append(joint(f"{side}UpLeg", (9 * s, -5, 0), joint(f"{side}Leg", (0, -40, 0), foot)))
    head = joint("Neck", (0, 27, 0), joint("Head", (0, 10, 0), end((0, 12, 0))))
    spine = joint(
        "ToSpine", (0, 7, 0), joint("Spine", (0, 10, 0), joint("Spine1", (0, 12, 0), head, *arms))
    )
    rows = "\n".join(f"{vector((0, 95, 4.0 * t))} " + " ".join(["0"] * 66) for t in range(frames))
    return (
        f"HIERARCHY\nROOT Hips\n{{\nOFFSET 1 2 3\n"
        f"CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        f"{spine}{''.join(legs)}}}\nMOTION\nFrames: {frames}\nFrame Time: {frame_time}\n{rows}\n"
    )


@pytest.mark.parametrize(
    ("scale", "z_up"), [(1.0, False), (0.01, False), (1.0, True), (0.01, True)]
)
def test_units_axes_and_rate_are_told_apart(tmp_path, scale, z_up):
    path = tmp_path / "walk.bvh"
    path.write_text(bvh(scale, z_up))
    demo = load_accad(path)
    assert demo.fps == 30 and demo.num_frames == 3
    assert demo.joint_names == ACCAD.joint_names
    hips = demo.positions[:, 0]
    # Forward is +z with y up, which becomes −y; left stays left.
    np.testing.assert_allclose(hips[0], [0, 0, 0.95], atol=1e-9)
    np.testing.assert_allclose(hips[2], [0, -0.32, 0.95], atol=1e-9)
    names = demo.joint_names
    left, right = (demo.positions[0, names.index(f"{s}UpLeg")] for s in ("Left", "Right"))
    up = demo.positions[0, names.index("Head")] - hips[0]
    toe = demo.positions[0, names.index("LeftToeBase")] - demo.positions[0, names.index("LeftFoot")]
    assert np.cross(left - right, up) @ toe > 0
    # Ankle to the crown 163 cm, plus the ankle's own height and the scalp.
    assert demo.height == pytest.approx(1.63 + 0.09, abs=1e-6)
    assert load_accad(path, height=1.6).height == 1.6


def test_other_skeletons_name_the_missing_joints(tmp_path):
    path = tmp_path / "other.bvh"
    path.write_text(bvh().replace("RightForeArm", "rForeArm"))
    with pytest.raises(FileFormatError, match=r"no RightForeArm\."):
        load_accad(path)


def test_cmu_names_are_refused_clearly(shared):
    with pytest.raises(FileFormatError, match=r"ACCAD skeleton.*Hips"):
        load_demonstration(shared / "data/cmu/01_01.bvh")


@pytest.mark.parametrize(
    "clip", ["B03_Walk1", "B09_WalkTurnLeft90", "A11_CrawlForward", "A06_LiftBox"]
)
def test_recorded_clips(shared, clip):
    demo = load_demonstration(shared / f"data/accad/Female1_{clip}.bvh")
    assert demo.fps == 30 and 1.6 < demo.height < 1.75

    def joint(name):
        return demo.positions[:, demo.joint_names.index(name)]

    # Not mirrored: forward, from the left hip and the spine, is where the toes point.
    forward = np.cross(joint("LeftUpLeg") - joint("RightUpLeg"), joint("Neck") - joint("Hips"))
    toes = joint("LeftToeBase") - joint("LeftFoot")
    assert np.mean(np.sum(forward * toes, axis=1) > 0) > 0.99
    source = scale_demonstration(demo, 1.32)
    pelvis = source.keypoints[:, 0, 2]
    if "Crawl" in clip:
        assert pelvis.min() > 0.05 and pelvis.max() < 0.3
        assert source.contacts["right_knee"].any()
        knees = source.keypoints[:, [KEYPOINTS.index(f"{s}_knee") for s in ("left", "right")], 2]
        assert knees.min() == pytest.approx(0.04 * source.scale)
    if "Walk" in clip:
        assert pelvis.min() > 0.65 and pelvis.max() < 0.8
        for foot, name in enumerate(("left_toe", "right_toe")):
            height = source.keypoints[:, KEYPOINTS.index(name), 2]
            standing = [
                height[a:b].mean() for a, b in stance_intervals(source.stance["default"][:, foot])
            ]
            assert np.ptp(standing) < 0.03  # the recorded floor rises by 8 cm on the way
