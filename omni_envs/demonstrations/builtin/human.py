"""A human body of average proportions, posed from pelvis, chest, feet and hands in closed form.

Segment lengths are those of SMPL's average body to a few centimetres, with the ankle at the upper
end of the ankle joint; segment masses follow de Leva (1996). Legs and arms are solved as two links
in closed form, so planted feet and grasping hands are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.demonstrations.skeleton import Skeleton
from omni_envs.robots import SIDES

HEIGHT = 1.72
MASS = 70.0

HIP = (0.0, 0.085, -0.08)  # from the pelvis joint, left side
THIGH, SHIN = 0.395, 0.36
ANKLE_FROM_TOE = np.array([-0.135, 0.0, 0.075])  # flat foot pointing along +x
HEEL_FROM_TOE = np.array([-0.185, 0.0, -0.02])
TOES_FROM_TOE = np.array([0.045, 0.0, -0.01])
SPINE = (0.10, 0.13, 0.07, 0.20)  # pelvis – torso – spine – chest – neck
COLLAR = np.array([-0.01, 0.07, 0.11])  # from the chest joint, left side
SHOULDER = np.array([0.0, 0.175, 0.10])
NECK_TO_HEAD = 0.10
UPPER_ARM, FOREARM = 0.285, 0.25
PALM, PALM_DEPTH, FINGER = 0.085, 0.025, 0.17

JOINTS = (
    "Pelvis",
    *("L_Hip", "L_Knee", "L_Ankle", "L_Toe", "R_Hip", "R_Knee", "R_Ankle", "R_Toe"),
    *("Torso", "Spine", "Chest", "Neck", "Head"),
    *("L_Thorax", "L_Shoulder", "L_Elbow", "L_Wrist"),
    *("R_Thorax", "R_Shoulder", "R_Elbow", "R_Wrist"),
    *("L_Heel", "L_Toes", "L_Palm", "L_Fingers", "R_Heel", "R_Toes", "R_Palm", "R_Fingers"),
)
"""The 22 body joints in SMPL-H order, then heels, toes, the skin of the palms and fingertips.

``Toe`` is the joint at the ball of the foot, ``Toes`` the middle of the big toe."""

# (from joint, to joint, centre along the segment, share of the body mass)
_SEGMENTS = (
    ("Neck", "Head", 1.7, 0.069),
    ("Chest", "Neck", 0.5, 0.160),
    ("Spine", "Chest", 0.0, 0.163),
    ("Pelvis", "Torso", 0.2, 0.112),
    *((f"{s}_Hip", f"{s}_Knee", 0.41, 0.142) for s in "LR"),
    *((f"{s}_Knee", f"{s}_Ankle", 0.44, 0.043) for s in "LR"),
    *((f"{s}_Ankle", f"{s}_Toe", 0.5, 0.014) for s in "LR"),
    *((f"{s}_Shoulder", f"{s}_Elbow", 0.55, 0.027) for s in "LR"),
    *((f"{s}_Elbow", f"{s}_Wrist", 0.45, 0.016) for s in "LR"),
    *((f"{s}_Wrist", f"{s}_Palm", 0.9, 0.006) for s in "LR"),
)


@dataclass(frozen=True)
class Feet:
    """Poses of both feet: toe joints (T, 2, 3), yaw, pitch (heel up), toe share (T, 2)."""

    toes: np.ndarray
    yaw: np.ndarray
    pitch: np.ndarray
    share: np.ndarray


@dataclass(frozen=True)
class Hands:
    """Poses of both hands: wrists (T, 2, 3), finger and palm directions, elbow poles (T, 2, 3)."""

    wrists: np.ndarray
    fingers: np.ndarray
    palms: np.ndarray
    poles: np.ndarray


def turn(
    yaw: np.ndarray, pitch: np.ndarray | float = 0.0, roll: np.ndarray | float = 0.0
) -> np.ndarray:
    """Rotation matrices (…, 3, 3): roll about x, then pitch about y (forward), then yaw about z."""
    yaw, pitch, roll = np.broadcast_arrays(yaw, pitch, roll)
    cz, sz, cy, sy = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    cx, sx = np.cos(roll), np.sin(roll)
    rows = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.stack([np.stack(r, axis=-1) for r in rows], axis=-2)


def two_links(
    root: np.ndarray, tip: np.ndarray, lengths: tuple[float, float], pole: np.ndarray
) -> np.ndarray:
    """Middle joint (…, 3) of two links from root to tip, bent towards the pole direction.

    A tip out of reach is met by a straight limb along the same line; callers check reach.
    """
    a, b = lengths
    line = tip - root
    distance = np.linalg.norm(line, axis=-1, keepdims=True)
    line = line / distance
    reach = np.clip(distance, abs(a - b), a + b)
    along = (a**2 - b**2 + reach**2) / (2.0 * reach)
    side = pole - np.sum(pole * line, axis=-1, keepdims=True) * line
    side = side / np.linalg.norm(side, axis=-1, keepdims=True)
    return root + along * line + np.sqrt(np.maximum(a**2 - along**2, 0.0)) * side


def torso(
    pelvis: np.ndarray,
    pelvis_turn: np.ndarray,
    chest_turn: np.ndarray,
    head_turn: np.ndarray,
    reach: np.ndarray,
) -> dict[str, np.ndarray]:
    """Joints of hips, spine, head and shoulders: name to (T, 3).

    Args:
        pelvis: (T, 3) pelvis joint.
        pelvis_turn: (T, 3) yaw, pitch, roll of the pelvis.
        chest_turn: (T, 3) of the chest; the spine bends evenly between the two.
        head_turn: (T, 3) of the head.
        reach: (T,) how far the shoulders are pushed forward, m.
    """
    joints = {"Pelvis": pelvis}
    hips = turn(*pelvis_turn.T)
    chest = turn(*chest_turn.T)
    at = pelvis
    names = ("Torso", "Spine", "Chest", "Neck")
    for name, length, share in zip(names, SPINE, (0.0, 0.5, 0.8, 1.0), strict=True):
        frame = turn(*((1 - share) * pelvis_turn + share * chest_turn).T)
        at = at + length * frame[..., 2]
        joints[name] = at
    neck = turn(*(0.5 * (chest_turn + head_turn)).T)
    joints["Head"] = at + NECK_TO_HEAD * neck[..., 2]
    for side, sign in (("L", 1.0), ("R", -1.0)):
        mirror = np.array([1.0, sign, 1.0])
        joints[f"{side}_Hip"] = pelvis + hips @ (mirror * HIP)
        joints[f"{side}_Thorax"] = joints["Chest"] + chest @ (mirror * COLLAR)
        joints[f"{side}_Shoulder"] = joints["Chest"] + chest @ (mirror * SHOULDER)
        joints[f"{side}_Shoulder"] += reach[:, None] * chest[..., 0]
    return joints


def add_legs(joints: dict[str, np.ndarray], feet: Feet, knees_out: np.ndarray) -> None:
    """Adds knees, ankles, heels and toes; ``knees_out`` (T,) turns the knees outward, rad."""
    for i, (side, sign) in enumerate((("L", 1.0), ("R", -1.0))):
        frame = turn(feet.yaw[:, i], feet.pitch[:, i])
        toe = feet.toes[:, i]
        joints[f"{side}_Toe"] = toe
        joints[f"{side}_Heel"] = toe + frame @ HEEL_FROM_TOE
        toes = turn(feet.yaw[:, i], feet.pitch[:, i] * feet.share[:, i])
        joints[f"{side}_Toes"] = toe + toes @ TOES_FROM_TOE
        ankle = joints[f"{side}_Ankle"] = toe + frame @ ANKLE_FROM_TOE
        forward = turn(feet.yaw[:, i] + sign * knees_out)[..., 0]
        joints[f"{side}_Knee"] = two_links(joints[f"{side}_Hip"], ankle, (THIGH, SHIN), forward)


def add_arms(joints: dict[str, np.ndarray], hands: Hands) -> None:
    """Adds elbows, wrists, palms and fingertips."""
    for i, side in enumerate("LR"):
        wrist = joints[f"{side}_Wrist"] = hands.wrists[:, i]
        joints[f"{side}_Elbow"] = two_links(
            joints[f"{side}_Shoulder"], wrist, (UPPER_ARM, FOREARM), hands.poles[:, i]
        )
        fingers, palm = hands.fingers[:, i], hands.palms[:, i]
        joints[f"{side}_Palm"] = wrist + PALM * fingers + PALM_DEPTH * palm
        joints[f"{side}_Fingers"] = wrist + FINGER * fingers + PALM_DEPTH * palm


def centre_of_mass(joints: dict[str, np.ndarray]) -> np.ndarray:
    """(T, 3) centre of mass."""
    total = sum(share for *_, share in _SEGMENTS)
    com = np.zeros_like(joints["Pelvis"])
    for start, stop, along, share in _SEGMENTS:
        com += share / total * ((1 - along) * joints[start] + along * joints[stop])
    return com


SKELETON = Skeleton(
    name="human",
    joint_names=JOINTS,
    keypoint_joints={
        "pelvis": "Pelvis",
        **{
            f"{side}_{part}": f"{side[0].upper()}_{joint}"
            for side in SIDES
            for part, joint in (
                ("hip", "Hip"),
                ("knee", "Knee"),
                ("ankle", "Ankle"),
                ("toe", "Toes"),  # like the tip of a robot's rigid foot
                ("shoulder", "Shoulder"),
                ("elbow", "Elbow"),
                ("hand", "Wrist"),
            )
        },
    },
    contact_joints={
        f"{side}_{link}": tuple(f"{side[0].upper()}_{joint}" for joint in joints)
        for side in SIDES
        for link, joints in (
            # Palm and fingers lie flat: equally near, the touched point would jump between them.
            ("hand", ("Palm",)),
            ("foot", ("Toes", "Heel")),
            ("knee", ("Knee",)),
        )
    },
)
"""The made human as a source skeleton."""
