"""How capture systems, libraries and exporters call the joints of a person."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from omni_envs.demonstrations.skeleton import MOCAP, SMPLH, Skeleton
from omni_envs.demonstrations.skeleton_map import SkeletonMap, read_skeleton_map
from omni_envs.errors import FileFormatError, UnknownNameError
from omni_envs.robots import SIDES

_LIMBS = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "hand")


@dataclass(frozen=True)
class Naming:
    """One way to name joints. Patterns carry ``{Left}``, ``{left}``, ``{L}`` or ``{l}``.

    Attributes:
        name: What it is called in ``skeleton=``.
        about: Who writes it.
        pelvis: Joint of the pelvis.
        limbs: Patterns of hip, knee, ankle, toe, shoulder, elbow and hand.
        head_top: Joints that may mark the top of the head.
        hallmark: A joint that must be there as well, to tell two namings apart.
        orders: Orders of the joints in arrays without names.
    """

    name: str
    about: str
    pelvis: str
    limbs: tuple[str, str, str, str, str, str, str]
    head_top: tuple[str, ...] = ()
    hallmark: str | None = None
    orders: tuple[tuple[str, ...], ...] = ()

    def keypoints(self) -> dict[str, str]:
        """For every keypoint the joint that plays it."""
        table = {"pelvis": self.pelvis}
        for side in SIDES:
            title = side.capitalize()
            words = {"Left": title, "left": side, "L": title[0], "l": side[0]}
            for limb, pattern in zip(_LIMBS, self.limbs, strict=True):
                table[f"{side}_{limb}"] = pattern.format(**words)
        return table


SMPL_BODY = (
    *("Pelvis", "L_Hip", "R_Hip", "Spine1", "L_Knee", "R_Knee", "Spine2", "L_Ankle", "R_Ankle"),
    *("Spine3", "L_Foot", "R_Foot", "Neck", "L_Collar", "R_Collar", "Head", "L_Shoulder"),
    *("R_Shoulder", "L_Elbow", "R_Elbow", "L_Wrist", "R_Wrist"),
)
"""The 22 joints that every model of the SMPL family begins with."""

_FINGERS = tuple(
    f"{side}_{finger}{i}"
    for side in "LR"
    for finger in ("Index", "Middle", "Pinky", "Ring", "Thumb")
    for i in (1, 2, 3)
)
SMPL_ORDERS = {
    22: SMPL_BODY,
    24: (*SMPL_BODY, "L_Hand", "R_Hand"),
    52: (*SMPL_BODY, *_FINGERS),
    55: (*SMPL_BODY, "Jaw", "L_Eye", "R_Eye", *_FINGERS),
}
"""Joints of the body alone, of SMPL, SMPL-H and SMPL-X, by their number."""

_LAFAN1 = (
    *("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToe", "RightUpLeg", "RightLeg"),
    *("RightFoot", "RightToe", "Spine", "Spine1", "Spine2", "Neck", "Head", "LeftShoulder"),
    *("LeftArm", "LeftForeArm", "LeftHand", "RightShoulder", "RightArm", "RightForeArm"),
    "RightHand",
)
_MOTION_BUILDER = (
    *("{Left}UpLeg", "{Left}Leg", "{Left}Foot", "{Left}ToeBase"),
    *("{Left}Arm", "{Left}ForeArm", "{Left}Hand"),
)
_HEAD_TOPS = ("HeadEnd", "HeadTop_End", "HeadTop", "Head_End", "HeadTip", "headEnd", "head_end")

NAMINGS: tuple[Naming, ...] = (
    Naming(
        "lafan1",
        "Ubisoft LAFAN1",
        "Hips",
        (*_MOTION_BUILDER[:3], "{Left}Toe", *_MOTION_BUILDER[4:]),
        orders=(_LAFAN1,),
    ),
    Naming("accad", "ACCAD, Ohio State", "Hips", _MOTION_BUILDER, _HEAD_TOPS, "ToSpine"),
    Naming("cmu", "CMU, MotionBuilder names", "Hips", _MOTION_BUILDER, _HEAD_TOPS, "LHipJoint"),
    Naming("mixamo", "Mixamo, HumanIK, MotionBuilder", "Hips", _MOTION_BUILDER, _HEAD_TOPS),
    Naming(
        "daz",
        "CMU, Daz names (cgspeed)",
        "hip",
        ("{l}Thigh", "{l}Shin", "{l}Foot", "{l}FootEnd", "{l}Shldr", "{l}ForeArm", "{l}Hand"),
    ),
    Naming(
        "xsens",
        "Xsens MVN",
        "Hips",
        (
            *("{Left}Hip", "{Left}Knee", "{Left}Ankle", "{Left}Toe"),
            *("{Left}Shoulder", "{Left}Elbow", "{Left}Wrist"),
        ),
        _HEAD_TOPS,
    ),
    Naming(
        "rokoko",
        "Rokoko Newton",
        "Hips",
        (
            *("{Left}Thigh", "{Left}Shin", "{Left}Foot", "{Left}Toe"),
            *("{Left}Arm", "{Left}ForeArm", "{Left}Hand"),
        ),
        _HEAD_TOPS,
    ),
    Naming(
        "bandai-namco",
        "Bandai-Namco Research",
        "Hips",
        (
            *("UpperLeg_{L}", "LowerLeg_{L}", "Foot_{L}", "Toes_{L}"),
            *("UpperArm_{L}", "LowerArm_{L}", "Hand_{L}"),
        ),
        _HEAD_TOPS,
    ),
    Naming(
        "smpl",
        "SMPL family",
        "Pelvis",
        (
            *("{L}_Hip", "{L}_Knee", "{L}_Ankle", "{L}_Foot"),
            *("{L}_Shoulder", "{L}_Elbow", "{L}_Wrist"),
        ),
        orders=tuple(SMPL_ORDERS.values()),
    ),
    Naming(
        "smplx",
        "SMPL family, names of the smplx package",
        "pelvis",
        (
            *("{left}_hip", "{left}_knee", "{left}_ankle", "{left}_foot"),
            *("{left}_shoulder", "{left}_elbow", "{left}_wrist"),
        ),
    ),
    Naming(
        "keypoints",
        "the keypoints themselves",
        "pelvis",
        (
            *("{left}_hip", "{left}_knee", "{left}_ankle", "{left}_toe"),
            *("{left}_shoulder", "{left}_elbow", "{left}_hand"),
        ),
    ),
)
"""Known namings; the first that a file satisfies is taken."""

_KNOWN: dict[str, Skeleton] = {"mocap": MOCAP, "smplh": SMPLH}


def skeleton_names() -> tuple[str, ...]:
    """Names that ``skeleton=`` takes beside a YAML file."""
    return (*(naming.name for naming in NAMINGS), *_KNOWN)


def short_names(joint_names: Sequence[str]) -> list[str]:
    """Joint names without the namespace in front.

    What stands before the last colon goes (``mixamorig:Hips``), then a prefix that ends in an
    underscore and that all joints share (``Character1_Hips``).
    """
    names = [name.rpartition(":")[2] for name in joint_names]
    first, last = min(names, default=""), max(names, default="")
    shared = next((i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), 0)
    cut = first[:shared].rfind("_") + 1
    names = [name[cut:] for name in names] if len(names) > 1 else names
    return names if len(set(names)) == len(names) else list(joint_names)


def recognise(joint_names: Sequence[str]) -> SkeletonMap | None:
    """Finds the naming that a file follows.

    Args:
        joint_names: Its joints.

    Returns:
        The map in the file's own names, or None.
    """
    for naming in NAMINGS:
        found = _follow(naming, joint_names)
        if found is not None:
            return found
    for name, skeleton in _KNOWN.items():
        if set(skeleton.joint_names) <= set(joint_names):
            return _map_of(name, skeleton)
    return None


def skeleton_map(
    skeleton: str | Path, joint_names: Sequence[str], path: Path, joints: int | None = None
) -> SkeletonMap:
    """The map that a user asked for: a known name or a YAML file.

    Args:
        skeleton: Name of ``skeleton_names()``, or a YAML file.
        joint_names: Joints of the file; empty for an array without names.
        path: The file, for error messages.
        joints: Number of joints of an array without names.

    Raises:
        UnknownNameError: Neither a known name nor a file.
        FileFormatError: The YAML file cannot be used, or the file does not follow the naming.
    """
    name = str(skeleton)
    if name in _KNOWN:
        return _map_of(name, _KNOWN[name])
    for naming in NAMINGS:
        if naming.name == name:
            if not joint_names and naming.orders:
                order = next((o for o in naming.orders if len(o) == joints), naming.orders[0])
                return SkeletonMap(name, naming.keypoints(), joint_names=order)
            found = _follow(naming, joint_names)
            if found is not None:
                return found
            lacks = [j for j in naming.keypoints().values() if j not in short_names(joint_names)]
            expected = f"the naming {name!r}"
            raise FileFormatError(path, "joints", expected, f"no {', '.join(lacks)}")
    if not re.search(r"\.ya?ml$", name, re.IGNORECASE) and not Path(name).exists():
        raise UnknownNameError("skeleton", name, (*skeleton_names(), "FILE.yaml"))
    return read_skeleton_map(skeleton)


def nameless_orders(joints: int) -> list[SkeletonMap]:
    """Known orders of joints for arrays of ``joints`` joints without names."""
    orders = [_map_of(name, s) for name, s in _KNOWN.items() if s.num_joints == joints]
    return orders + [
        SkeletonMap(naming.name, naming.keypoints(), joint_names=order)
        for naming in NAMINGS
        for order in naming.orders
        if len(order) == joints
    ]


def _follow(naming: Naming, joint_names: Sequence[str]) -> SkeletonMap | None:
    own = dict(zip(short_names(joint_names), joint_names, strict=True))
    wanted = naming.keypoints()
    if naming.hallmark is not None and naming.hallmark not in own:
        return None
    if any(joint not in own for joint in wanted.values()):
        return None
    top = next((own[name] for name in naming.head_top if name in own), None)
    return SkeletonMap(naming.name, {k: own[j] for k, j in wanted.items()}, head_top=top)


def _map_of(name: str, skeleton: Skeleton) -> SkeletonMap:
    return SkeletonMap(
        name,
        skeleton.keypoint_joints,
        contacts=skeleton.contact_joints,
        joint_names=skeleton.joint_names,
    )
