"""Booster T1, 23 degrees of freedom."""

from __future__ import annotations

from pathlib import Path

from omni_envs.robots.robot import SIDES, BodyPoint, Foot, Robot
from omni_envs.robots.tables import Drive, both, contact_links, limb, same, sided

_ARMATURE = 0.03  # kg m², as in holosoma; the manufacturer publishes none


def _drive(effort: float, speed: float, stiffness: float, damping: float) -> Drive:
    return Drive(effort, speed, stiffness, damping, _ARMATURE)


# Gains of holosoma's T1: there are no published rotor inertias to derive gains of a given
# frequency from. Stiff gains on small motors: the legs' action scales are a tenth of the G1's.
_HEAD = _drive(effort=7.0, speed=12.56, stiffness=5.0, damping=0.5)
_ARM = _drive(effort=18.0, speed=18.84, stiffness=20.0, damping=0.5)
_WAIST = _drive(effort=30.0, speed=10.88, stiffness=200.0, damping=5.0)
_HIP = _drive(effort=30.0, speed=10.9, stiffness=200.0, damping=5.0)
_LEG = {
    "Hip_Pitch": _drive(effort=45.0, speed=12.5, stiffness=200.0, damping=5.0),
    "Hip_Roll": _HIP,
    "Hip_Yaw": _HIP,
    "Knee_Pitch": _drive(effort=60.0, speed=11.7, stiffness=200.0, damping=5.0),
    "Ankle_Pitch": _drive(effort=20.0, speed=18.8, stiffness=50.0, damping=3.0),
    "Ankle_Roll": _drive(effort=15.0, speed=12.4, stiffness=50.0, damping=3.0),
}
# Elbow_Pitch turns the upper arm about itself, Elbow_Yaw bends the elbow.
_ARMS = dict.fromkeys(("Shoulder_Pitch", "Shoulder_Roll", "Elbow_Pitch", "Elbow_Yaw"), _ARM)


_JOINT = "{Side}_{joint}"
_ACTUATORS = (
    _HEAD.actuator("AAHead_yaw"),
    _HEAD.actuator("Head_pitch"),
    *limb(_JOINT, "left", _ARMS),
    *limb(_JOINT, "right", _ARMS),
    _WAIST.actuator("Waist"),
    *limb(_JOINT, "left", _LEG),
    *limb(_JOINT, "right", _LEG),
)


def _keypoints() -> dict[str, BodyPoint]:
    points = {"pelvis": BodyPoint("Trunk")}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        points |= {
            f"{side}_hip": BodyPoint(sided("Hip_Pitch_{Side}", side)),
            f"{side}_knee": BodyPoint(sided("Shank_{Side}", side)),
            f"{side}_ankle": BodyPoint(sided("Ankle_Cross_{Side}", side)),
            f"{side}_toe": BodyPoint(f"{side}_foot_link", (0.12, 0.0, -0.03)),
            f"{side}_shoulder": BodyPoint(sided("A{S}1", side)),
            f"{side}_elbow": BodyPoint(f"{side}_hand_link"),
            f"{side}_hand": BodyPoint(f"{side}_hand_link", (0.0, sign * 0.2, 0.0)),
        }
    return points


_SOLE = (
    (-0.1, 0.025, -0.03),
    (-0.1, -0.025, -0.03),
    (0.11, 0.03, -0.03),
    (0.11, -0.03, -0.03),
    (0.12, 0.0, -0.03),
)

T1 = Robot(
    name="t1",
    title="Booster T1",
    mjcf=Path(__file__).with_name("t1.xml"),
    height=1.2,
    # The legs hang below the trunk on the waist joint: the root is the upper body.
    root_body="Trunk",
    anchor_body="Trunk",
    torso_body="Trunk",
    actuators=_ACTUATORS,
    default_root_height=0.66585,
    default_joint_positions={
        # The published ankle of -0.25 tips the soles 3° out of the ground.
        **same(_JOINT, Shoulder_Pitch=0.2, Hip_Pitch=-0.2, Knee_Pitch=0.4, Ankle_Pitch=-0.2),
        "Left_Shoulder_Roll": -1.35,
        "Right_Shoulder_Roll": 1.35,
        "Left_Elbow_Yaw": -0.5,
        "Right_Elbow_Yaw": 0.5,
    },
    keypoints=_keypoints(),
    feet={side: Foot(f"{side}_foot_link", _SOLE) for side in SIDES},
    contact_links=contact_links(
        hand="{side}_hand_link", foot="{side}_foot_link", knee="Shank_{Side}"
    ),
    tracked_bodies=(
        "Trunk",
        "Waist",
        *both("Hip_Yaw_{Side}", "Shank_{Side}", "{side}_foot_link"),
        *both("A{S}1", "A{S}3", "{side}_hand_link"),
    ),
    end_effectors=(*both("{side}_foot_link"), *both("{side}_hand_link")),
    posture_weights={"Waist": 0.2},
)
