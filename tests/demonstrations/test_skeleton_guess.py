from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import SourceOptions
from omni_envs.demonstrations.bvh_source import record_bvh
from omni_envs.demonstrations.namings import NAMINGS, recognise
from omni_envs.demonstrations.recording import Recording
from omni_envs.demonstrations.skeleton_guess import guess_skeleton
from omni_envs.errors import FileFormatError

LIMBS = {
    "UpLeg": "hip", "Leg": "knee", "Foot": "ankle", "Toe": "toe",
    "Arm": "shoulder", "ForeArm": "elbow", "Hand": "hand",
}  # fmt: skip


def truth(rename):
    table = {"pelvis": rename("Hips")}
    for side in ("left", "right"):
        for joint, part in LIMBS.items():
            table[f"{side}_{part}"] = rename(side.capitalize() + joint)
    return table


def renamer(pattern, **parts):
    """From ``LeftUpLeg`` to ``pattern`` with the side in it, and the parts called otherwise."""

    def rename(name):
        for title, side in (("Left", "l"), ("Right", "r")):
            if name.startswith(title):
                part = parts.get(name[len(title) :], name[len(title) :].lower())
                return pattern.format(
                    s=side, S=side.upper(), Side=title, side=title.lower(), p=part
                )
        return parts.get(name, name)

    return rename


UNREAL = renamer(
    "{p}_{s}", Hips="pelvis", UpLeg="thigh", Leg="calf", Foot="foot", Toe="ball",
    Shoulder="clavicle", Arm="upperarm", ForeArm="lowerarm", Hand="hand",
)  # fmt: skip
BIPED = renamer(
    "Bip01_{S}_{p}", Hips="Bip01_Pelvis", UpLeg="Thigh", Leg="Calf", Foot="Foot", Toe="Toe0",
    Shoulder="Clavicle", Arm="UpperArm", ForeArm="Forearm", Hand="Hand",
)  # fmt: skip
BLENDER = renamer(
    "{p}.{S}", Hips="hips", UpLeg="upper_leg", Leg="lower_leg", Foot="foot", Toe="toes",
    Shoulder="shoulder", Arm="upper_arm", ForeArm="forearm", Hand="hand",
)  # fmt: skip
JOINTED = renamer(
    "{side}{p}Jnt", Hips="rootJnt", UpLeg="hip", Leg="knee", Foot="ankle", Toe="toe",
    Shoulder="collar", Arm="shoulder", ForeArm="elbow", Hand="wrist",
)  # fmt: skip


@pytest.mark.parametrize("rename", [UNREAL, BIPED, BLENDER, JOINTED, lambda n: n])
@pytest.mark.parametrize("along_x", [False, True])
def test_other_namings_are_understood(person, write_bvh, rename, along_x):
    path = write_bvh(person(), rename=rename, bones_along_x=along_x)
    guess = guess_skeleton(record_bvh(path, SourceOptions()))
    assert dict(guess.skeleton.keypoints) == truth(rename)
    assert not guess.doubtful and min(guess.scores.values()) >= 0.6
    assert rename("Spine1") in guess.unused and rename("LeftToe") not in guess.unused


@pytest.mark.parametrize("rename", [UNREAL, BLENDER, lambda n: n])
def test_without_a_tree(person, rename):
    """Arrays carry no parents: the shorter chain of fitting names."""
    who = person()
    recording = Recording(Path("clip.npz"), tuple(map(rename, who.names)), who.pose()[0], 30.0)
    assert dict(guess_skeleton(recording).skeleton.keypoints) == truth(rename)


def test_sides_from_the_toes_where_names_tell_none(person, write_bvh):
    def numbered(name):
        return name.replace("Left", "").replace("Right", "") + ("001" if "Right" in name else "000")

    path = write_bvh(person(), rename=numbered)
    assert dict(guess_skeleton(record_bvh(path, SourceOptions())).skeleton.keypoints) == truth(
        numbered
    )
    other = write_bvh(person(), rename=lambda n: numbered(n).replace("001", "zzz")
                      .replace("000", "001").replace("zzz", "000"))  # fmt: skip
    found = guess_skeleton(record_bvh(other, SourceOptions())).skeleton.keypoints
    assert found["left_hip"] == "UpLeg001" and found["right_hand"] == "Hand000"


def test_known_namings_are_guessed_as_they_are_known(shared):
    for clip in ("cmu/01_01.bvh", "accad/Female1_B03_Walk1.bvh"):
        recording = record_bvh(shared / "data" / clip, SourceOptions(end=3.0))
        known = recognise(recording.joint_names)
        guess = guess_skeleton(recording)
        assert dict(guess.skeleton.keypoints) == dict(known.keypoints)
        assert guess.skeleton.head_top == known.head_top
    assert len(NAMINGS) > 5


def test_nothing_like_a_person():
    names = tuple(f"part{i}" for i in range(20))
    recording = Recording(
        Path("x.npz"), names, np.random.default_rng(0).normal(size=(5, 20, 3)), 30
    )
    with pytest.raises(FileFormatError, match=r"x\.npz: joints: expected two limbs of hip"):
        guess_skeleton(recording)
    with pytest.raises(FileFormatError, match="names to go by"):
        guess_skeleton(Recording(Path("x.npy"), (), np.zeros((5, 20, 3)), 30.0))
