"""Booster T1, 23 degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omni_envs.robots.robot import SIDES, Actuator, BodyPoint, Foot, Robot

_ARMATURE = 0.03  # kg m², as in holosoma; the manufacturer publishes none


@dataclass(frozen=True)
class _Drive:
    """A joint's drive: torque limit N m, speed limit rad/s, gains N m / rad and N m s / rad."""

    effort: float
    speed: float
    stiffness: float
    damping: float

    def drive(self, joint: str) -> Actuator:
        return Actuator(joint, self.stiffness, self.damping, self.effort, self.speed, _ARMATURE)


# Gains of holosoma's T1: there are no published rotor inertias to derive gains of a given
# frequency from. Stiff gains on small motors: the legs' action scales are a tenth of the G1's.
_HEAD = _Drive(effort=7.0, speed=12.56, stiffness=5.0, damping=0.5)
_ARM = _Drive(effort=18.0, speed=18.84, stiffness=20.0, damping=0.5)
_WAIST = _Drive(effort=30.0, speed=10.88, stiffness=200.0, damping=5.0)
_HIP = _Drive(effort=30.0, speed=10.9, stiffness=200.0, damping=5.0)
_LEG = {
    "Hip_Pitch": _Drive(effort=45.0, speed=12.5, stiffness=200.0, damping=5.0),
    "Hip_Roll": _HIP,
    "Hip_Yaw": _HIP,
    "Knee_Pitch": _Drive(effort=60.0, speed=11.7, stiffness=200.0, damping=5.0),
    "Ankle_Pitch": _Drive(effort=20.0, speed=18.8, stiffness=50.0, damping=3.0),
    "Ankle_Roll": _Drive(effort=15.0, speed=12.4, stiffness=50.0, damping=3.0),
}
# Elbow_Pitch turns the upper arm about itself, Elbow_Yaw bends the elbow.
_ARMS = dict.fromkeys(("Shoulder_Pitch", "Shoulder_Roll", "Elbow_Pitch", "Elbow_Yaw"), _ARM)


def _limb(side: str, drives: dict[str, _Drive]) -> tuple[Actuator, ...]:
    return tuple(drive.drive(f"{side}_{joint}") for joint, drive in drives.items())


_ACTUATORS = (
    _HEAD.drive("AAHead_yaw"),
    _HEAD.drive("Head_pitch"),
    *_limb("Left", _ARMS),
    *_limb("Right", _ARMS),
    _WAIST.drive("Waist"),
    *_limb("Left", _LEG),
    *_limb("Right", _LEG),
)

_NAMES = {"left": "Left", "right": "Right"}  # suffix of leg bodies, prefix of joints
_ARM_PREFIX = {"left": "AL", "right": "AR"}


def _both(**joints: float) -> dict[str, float]:
    """Joint values that are the same on both sides."""
    return {f"{_NAMES[s]}_{joint}": value for s in SIDES for joint, value in joints.items()}


def _keypoints() -> dict[str, BodyPoint]:
    points = {"pelvis": BodyPoint("Trunk")}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        name = _NAMES[side]
        points |= {
            f"{side}_hip": BodyPoint(f"Hip_Pitch_{name}"),
            f"{side}_knee": BodyPoint(f"Shank_{name}"),
            f"{side}_ankle": BodyPoint(f"Ankle_Cross_{name}"),
            f"{side}_toe": BodyPoint(f"{side}_foot_link", (0.12, 0.0, -0.03)),
            f"{side}_shoulder": BodyPoint(f"{_ARM_PREFIX[side]}1"),
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
        **_both(Shoulder_Pitch=0.2, Hip_Pitch=-0.2, Knee_Pitch=0.4, Ankle_Pitch=-0.2),
        "Left_Shoulder_Roll": -1.35,
        "Right_Shoulder_Roll": 1.35,
        "Left_Elbow_Yaw": -0.5,
        "Right_Elbow_Yaw": 0.5,
    },
    keypoints=_keypoints(),
    feet={side: Foot(f"{side}_foot_link", _SOLE) for side in SIDES},
    contact_links={
        f"{side}_{link}": bodies
        for side in SIDES
        for link, bodies in (
            ("hand", (f"{side}_hand_link",)),
            ("foot", (f"{side}_foot_link",)),
            ("knee", (f"Shank_{_NAMES[side]}",)),
        )
    },
    tracked_bodies=(
        "Trunk",
        "Waist",
        *(
            body
            for s in SIDES
            for body in (f"Hip_Yaw_{_NAMES[s]}", f"Shank_{_NAMES[s]}", f"{s}_foot_link")
        ),
        *(
            body
            for s in SIDES
            for body in (f"{_ARM_PREFIX[s]}1", f"{_ARM_PREFIX[s]}3", f"{s}_hand_link")
        ),
    ),
    end_effectors=(
        *(f"{s}_foot_link" for s in SIDES),
        *(f"{s}_hand_link" for s in SIDES),
    ),
    posture_weights={"Waist": 0.2},
)
