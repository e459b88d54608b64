"""Unitree G1, 29 degrees of freedom."""

from __future__ import annotations

from math import pi
from pathlib import Path

from omni_envs.robots.robot import SIDES, BodyPoint, Foot, Robot
from omni_envs.robots.tables import Drive, both, contact_links, limb, same

# Gains place every joint's undamped frequency at 10 Hz on the rotor inertia alone, damping ratio 2:
# kp = J ω², kd = 2 ζ J ω (BeyondMimic, arXiv 2508.08241).
_FREQUENCY = 2.0 * pi * 10.0  # rad/s
_DAMPING_RATIO = 2.0


def _motor(armature: float, effort: float, speed: float) -> Drive:
    stiffness = armature * _FREQUENCY**2
    damping = 2.0 * _DAMPING_RATIO * armature * _FREQUENCY
    return Drive(effort, speed, stiffness, damping, armature)


# Armature of a two-stage planetary drive: J = r0 (g1 g2)² + r1 g2² + r2, with rotor inertias r and
# gear ratios g of the motor; the values are those of mjlab's Unitree G1.
_7520_14 = _motor(armature=0.010177520, effort=88.0, speed=32.0)
_7520_22 = _motor(armature=0.025101925, effort=139.0, speed=20.0)
_5020 = _motor(armature=0.003609725, effort=25.0, speed=37.0)
_4010 = _motor(armature=0.00425, effort=5.0, speed=22.0)
# Two 5020 motors drive each ankle, and the upper waist, through four-bar linkages: taken as a sum.
_2X5020 = _motor(armature=0.00721945, effort=50.0, speed=37.0)

_LEG = {
    "hip_pitch": _7520_14,
    "hip_roll": _7520_22,
    "hip_yaw": _7520_14,
    "knee": _7520_22,
    "ankle_pitch": _2X5020,
    "ankle_roll": _2X5020,
}
_WAIST = {"waist_yaw": _7520_14, "waist_roll": _2X5020, "waist_pitch": _2X5020}
_ARM = {
    "shoulder_pitch": _5020,
    "shoulder_roll": _5020,
    "shoulder_yaw": _5020,
    "elbow": _5020,
    "wrist_roll": _5020,
    "wrist_pitch": _4010,
    "wrist_yaw": _4010,
}


_JOINT = "{side}_{joint}_joint"
_ACTUATORS = (
    *limb(_JOINT, "left", _LEG),
    *limb(_JOINT, "right", _LEG),
    *(motor.actuator(f"{joint}_joint") for joint, motor in _WAIST.items()),
    *limb(_JOINT, "left", _ARM),
    *limb(_JOINT, "right", _ARM),
)


def _keypoints() -> dict[str, BodyPoint]:
    points = {"pelvis": BodyPoint("pelvis")}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        points |= {
            f"{side}_hip": BodyPoint(f"{side}_hip_pitch_link"),
            f"{side}_knee": BodyPoint(f"{side}_knee_link"),
            # The ankle of the human sits above the robot's ankle axes, on the shin.
            f"{side}_ankle": BodyPoint(f"{side}_knee_link", (0.0, 0.0, -0.28)),
            f"{side}_toe": BodyPoint(f"{side}_ankle_roll_link", (0.14, 0.0, -0.03)),
            f"{side}_shoulder": BodyPoint(f"{side}_shoulder_roll_link"),
            f"{side}_elbow": BodyPoint(f"{side}_elbow_link"),
            # Where the hand is mounted.
            f"{side}_hand": BodyPoint(f"{side}_wrist_yaw_link", (0.0415, sign * 0.003, 0.0)),
        }
    return points


_SOLE = (
    (-0.05, 0.025, -0.035),
    (-0.05, -0.025, -0.035),
    (0.12, 0.03, -0.035),
    (0.12, -0.03, -0.035),
    (0.14, 0.0, -0.035),
)

G1 = Robot(
    name="g1",
    title="Unitree G1",
    mjcf=Path(__file__).with_name("g1.xml"),
    height=1.32,
    root_body="pelvis",
    anchor_body="pelvis",
    torso_body="torso_link",
    actuators=_ACTUATORS,
    # The published 0.76 leaves the soles 3 mm in the air.
    default_root_height=0.757,
    default_joint_positions={
        **same(
            _JOINT, hip_pitch=-0.312, knee=0.669, ankle_pitch=-0.363, shoulder_pitch=0.2, elbow=0.6
        ),
        "left_shoulder_roll_joint": 0.2,
        "right_shoulder_roll_joint": -0.2,
    },
    keypoints=_keypoints(),
    feet={side: Foot(f"{side}_ankle_roll_link", _SOLE) for side in SIDES},
    contact_links=contact_links(
        hand="{side}_wrist_yaw_link", foot="{side}_ankle_roll_link", knee="{side}_knee_link"
    ),
    tracked_bodies=(
        "pelvis",
        *both("{side}_hip_roll_link", "{side}_knee_link", "{side}_ankle_roll_link"),
        "torso_link",
        *both("{side}_shoulder_roll_link", "{side}_elbow_link", "{side}_wrist_yaw_link"),
    ),
    end_effectors=(*both("{side}_ankle_roll_link"), *both("{side}_wrist_yaw_link")),
    # OmniRetarget's, narrower than the mechanics: the torso stays upright. Its wrists are as good
    # as locked, too, which lets no palm lie on what it touches: contact points are off by a quarter
    # more, and climbs cost a fifth more deformation energy. Ours bend where that is of use.
    reference_ranges={
        "waist_roll_joint": (-0.3, 0.3),
        "waist_pitch_joint": (-0.1, 0.52),
        **{f"{side}_elbow_joint": (-1.0472, 1.4) for side in SIDES},
    },
    posture_weights={
        "waist_yaw_joint": 0.2,
        "waist_roll_joint": 0.2,
        **same(_JOINT, wrist_roll=0.02, wrist_pitch=0.02, wrist_yaw=0.02),
    },
)
