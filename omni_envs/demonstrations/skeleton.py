"""Source skeletons: which joint plays which keypoint, and which joints touch things."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from omni_envs.errors import InvalidDataError
from omni_envs.robots import CONTACT_LINKS, KEYPOINTS, SIDES


@dataclass(frozen=True)
class Skeleton:
    """The joints of one source format.

    Attributes:
        name: Name of the format.
        joint_names: J joint names in file order.
        keypoint_joints: For every name in ``KEYPOINTS`` the joint that plays it.
        contact_joints: Link of ``CONTACT_LINKS`` to the joints whose distance decides contact.
    """

    name: str
    joint_names: tuple[str, ...]
    keypoint_joints: Mapping[str, str]
    contact_joints: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        named = [*self.keypoint_joints.values(), *sum(self.contact_joints.values(), ())]
        for what, wanted, found in (
            ("joint_names", set(named), set(self.joint_names)),
            ("keypoint_joints", set(KEYPOINTS), set(self.keypoint_joints)),
            ("contact links", set(self.contact_joints), set(CONTACT_LINKS)),
        ):
            if missing := wanted - found:
                raise InvalidDataError(
                    f"Skeleton {self.name!r}", what, f"with {sorted(missing)}", "none of these"
                )

    @property
    def num_joints(self) -> int:
        """J."""
        return len(self.joint_names)


def _keypoints(pelvis: str, **suffixes: str) -> dict[str, str]:
    """Keypoint table from a pelvis joint and ``part="pattern"`` with ``{L}`` or ``{Left}``."""
    sides = {"left": {"L": "L", "Left": "Left"}, "right": {"L": "R", "Left": "Right"}}
    table = {f"{s}_{part}": p.format(**sides[s]) for s in SIDES for part, p in suffixes.items()}
    return {"pelvis": pelvis, **table}


_SMPLH_FINGERS = ("Index", "Middle", "Pinky", "Ring", "Thumb")
_MOCAP_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")


def _smplh_arm(side: str) -> tuple[str, ...]:
    arm = ("Thorax", "Shoulder", "Elbow", "Wrist")
    fingers = tuple(f"{finger}{i}" for finger in _SMPLH_FINGERS for i in (1, 2, 3))
    return tuple(f"{side}_{joint}" for joint in arm + fingers)


def _smplh_leg(side: str) -> tuple[str, ...]:
    return tuple(f"{side}_{joint}" for joint in ("Hip", "Knee", "Ankle", "Toe"))


SMPLH = Skeleton(
    name="SMPL-H",
    joint_names=(
        "Pelvis",
        *_smplh_leg("L"),
        *_smplh_leg("R"),
        *("Torso", "Spine", "Chest", "Neck", "Head"),
        *_smplh_arm("L"),
        *_smplh_arm("R"),
    ),
    keypoint_joints=_keypoints(
        "Pelvis",
        hip="{L}_Hip",
        knee="{L}_Knee",
        ankle="{L}_Ankle",
        toe="{L}_Toe",
        shoulder="{L}_Shoulder",
        elbow="{L}_Elbow",
        hand="{L}_Wrist",
    ),
    contact_joints={
        "left_hand": _smplh_arm("L")[3:],
        "right_hand": _smplh_arm("R")[3:],
        "left_foot": ("L_Toe",),
        "right_foot": ("R_Toe",),
        "left_knee": ("L_Knee",),
        "right_knee": ("R_Knee",),
    },
)
"""The 52 SMPL-H joints in the depth-first order of InterMimic files."""


def _mocap_arm(side: str) -> tuple[str, ...]:
    fingers = tuple(f"Hand{finger}{i}" for finger in _MOCAP_FINGERS for i in (1, 2, 3))
    return tuple(f"{side}{joint}" for joint in ("Shoulder", "Arm", "ForeArm", "Hand", *fingers))


def _mocap_leg(side: str) -> tuple[str, ...]:
    return tuple(f"{side}{joint}" for joint in ("UpLeg", "Leg", "Foot", "ToeBase"))


def _mocap_contacts(hands: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    links: dict[str, tuple[str, ...]] = {}
    for side, title in (("left", "Left"), ("right", "Right")):
        links[f"{side}_hand"] = hands[title]
        links[f"{side}_foot"] = (f"{title}ToeBase",)
        links[f"{side}_knee"] = (f"{title}Leg",)
    return links


MOCAP = Skeleton(
    name="mocap",
    joint_names=(
        *("Hips", "Spine", "Spine1", "Neck", "Head"),
        *_mocap_arm("Left"),
        *_mocap_arm("Right"),
        *_mocap_leg("Left"),
        *_mocap_leg("Right"),
        *("LeftFootMod", "RightFootMod"),
    ),
    # Spine1, 0.3 m above Hips, leads the pelvis, as OmniRetarget chose. Its hand is the middle
    # fingertip, for a robot that ends in a ball there. Here it is the wrist, as in all other
    # formats: our keypoint is where the robot's hand is mounted, and with a fingertip instead a
    # hand of human length ends inside what the human touches.
    keypoint_joints=_keypoints(
        "Spine1",
        hip="{Left}UpLeg",
        knee="{Left}Leg",
        ankle="{Left}Foot",
        toe="{Left}ToeBase",
        shoulder="{Left}Arm",
        elbow="{Left}ForeArm",
        hand="{Left}Hand",
    ),
    contact_joints=_mocap_contacts({s: _mocap_arm(s)[3:] for s in ("Left", "Right")}),
)
"""The 53 joints of the climbing mocap arrays (T, 53, 3)."""
