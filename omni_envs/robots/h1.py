"""Unitree H1, 19 degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omni_envs.robots.robot import SIDES, Actuator, BodyPoint, Foot, Robot

_ARMATURE = 0.1  # kg m², of MuJoCo Menagerie; the manufacturer publishes none


@dataclass(frozen=True)
class _Drive:
    """A joint's drive: torque limit N m, speed limit rad/s, gains N m / rad and N m s / rad."""

    effort: float
    speed: float
    stiffness: float
    damping: float

    def drive(self, joint: str) -> Actuator:
        return Actuator(joint, self.stiffness, self.damping, self.effort, self.speed, _ARMATURE)


# The manufacturer's gains (unitree_rl_lab): H1 has no published rotor inertias to derive gains of a
# given frequency from.
_HIP = _Drive(effort=200.0, speed=23.0, stiffness=150.0, damping=2.0)
_TORSO = _Drive(effort=200.0, speed=23.0, stiffness=300.0, damping=6.0)
_LEG = {
    "hip_yaw": _HIP,
    "hip_roll": _HIP,
    "hip_pitch": _HIP,
    "knee": _Drive(effort=300.0, speed=14.0, stiffness=200.0, damping=4.0),
    "ankle": _Drive(effort=40.0, speed=9.0, stiffness=40.0, damping=2.0),
}
_ARM = {
    "shoulder_pitch": _Drive(effort=40.0, speed=9.0, stiffness=100.0, damping=2.0),
    "shoulder_roll": _Drive(effort=40.0, speed=9.0, stiffness=50.0, damping=2.0),
    "shoulder_yaw": _Drive(effort=18.0, speed=20.0, stiffness=50.0, damping=2.0),
    "elbow": _Drive(effort=18.0, speed=20.0, stiffness=50.0, damping=2.0),
}


def _limb(side: str, drives: dict[str, _Drive]) -> tuple[Actuator, ...]:
    return tuple(drive.drive(f"{side}_{joint}") for joint, drive in drives.items())


_ACTUATORS = (
    *_limb("left", _LEG),
    *_limb("right", _LEG),
    _TORSO.drive("torso"),
    *_limb("left", _ARM),
    *_limb("right", _ARM),
)


def _both(**joints: float) -> dict[str, float]:
    """Joint values that are the same on both sides."""
    return {f"{side}_{joint}": value for side in SIDES for joint, value in joints.items()}


def _keypoints() -> dict[str, BodyPoint]:
    points = {"pelvis": BodyPoint("pelvis")}
    for side in SIDES:
        points |= {
            f"{side}_hip": BodyPoint(f"{side}_hip_pitch_link"),
            f"{side}_knee": BodyPoint(f"{side}_knee_link"),
            f"{side}_ankle": BodyPoint(f"{side}_ankle_link"),
            f"{side}_toe": BodyPoint(f"{side}_ankle_link", (0.2, 0.0, -0.065)),
            f"{side}_shoulder": BodyPoint(f"{side}_shoulder_roll_link"),
            f"{side}_elbow": BodyPoint(f"{side}_elbow_link"),
            # H1 has no hand: the last 7 cm of its forearm play it, in a human's proportion.
            f"{side}_hand": BodyPoint(f"{side}_elbow_link", (0.2, 0.0, -0.0185)),
        }
    return points


# A blade, 30 mm wide.
_SOLE = (
    (-0.1, 0.015, -0.07),
    (-0.1, -0.015, -0.07),
    (0.2, 0.015, -0.07),
    (0.2, -0.015, -0.07),
    (0.2, 0.0, -0.07),
)

H1 = Robot(
    name="h1",
    title="Unitree H1",
    mjcf=Path(__file__).with_name("h1.xml"),
    height=1.8,
    root_body="pelvis",
    anchor_body="pelvis",
    torso_body="torso_link",
    actuators=_ACTUATORS,
    default_root_height=1.03423,
    default_joint_positions=_both(
        hip_pitch=-0.1, knee=0.3, ankle=-0.2, shoulder_pitch=0.2, elbow=0.32
    ),
    keypoints=_keypoints(),
    feet={side: Foot(f"{side}_ankle_link", _SOLE) for side in SIDES},
    contact_links={
        f"{side}_{link}": bodies
        for side in SIDES
        for link, bodies in (
            ("hand", (f"{side}_elbow_link",)),
            ("foot", (f"{side}_ankle_link",)),
            ("knee", (f"{side}_knee_link",)),
        )
    },
    tracked_bodies=(
        "pelvis",
        *(f"{s}_{b}_link" for s in SIDES for b in ("hip_pitch", "knee", "ankle")),
        "torso_link",
        *(f"{s}_{b}_link" for s in SIDES for b in ("shoulder_roll", "shoulder_yaw", "elbow")),
    ),
    end_effectors=(
        *(f"{s}_ankle_link" for s in SIDES),
        *(f"{s}_elbow_link" for s in SIDES),
    ),
    posture_weights={"torso": 0.2},
)
