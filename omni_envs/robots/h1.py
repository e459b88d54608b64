"""Unitree H1, 19 degrees of freedom."""

from __future__ import annotations

from pathlib import Path

from omni_envs.robots.robot import SIDES, BodyPoint, Foot, Robot
from omni_envs.robots.tables import Drive, both, contact_links, limb, same

_ARMATURE = 0.1  # kg m², of MuJoCo Menagerie; the manufacturer publishes none


def _drive(effort: float, speed: float, stiffness: float, damping: float) -> Drive:
    return Drive(effort, speed, stiffness, damping, _ARMATURE)


# The manufacturer's gains (unitree_rl_lab): H1 has no published rotor inertias to derive gains of a
# given frequency from.
_HIP = _drive(effort=200.0, speed=23.0, stiffness=150.0, damping=2.0)
_TORSO = _drive(effort=200.0, speed=23.0, stiffness=300.0, damping=6.0)
_LEG = {
    "hip_yaw": _HIP,
    "hip_roll": _HIP,
    "hip_pitch": _HIP,
    "knee": _drive(effort=300.0, speed=14.0, stiffness=200.0, damping=4.0),
    "ankle": _drive(effort=40.0, speed=9.0, stiffness=40.0, damping=2.0),
}
_ARM = {
    "shoulder_pitch": _drive(effort=40.0, speed=9.0, stiffness=100.0, damping=2.0),
    "shoulder_roll": _drive(effort=40.0, speed=9.0, stiffness=50.0, damping=2.0),
    "shoulder_yaw": _drive(effort=18.0, speed=20.0, stiffness=50.0, damping=2.0),
    "elbow": _drive(effort=18.0, speed=20.0, stiffness=50.0, damping=2.0),
}


_JOINT = "{side}_{joint}"
_ACTUATORS = (
    *limb(_JOINT, "left", _LEG),
    *limb(_JOINT, "right", _LEG),
    _TORSO.actuator("torso"),
    *limb(_JOINT, "left", _ARM),
    *limb(_JOINT, "right", _ARM),
)


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
    default_joint_positions=same(
        _JOINT, hip_pitch=-0.1, knee=0.3, ankle=-0.2, shoulder_pitch=0.2, elbow=0.32
    ),
    keypoints=_keypoints(),
    feet={side: Foot(f"{side}_ankle_link", _SOLE) for side in SIDES},
    contact_links=contact_links(
        hand="{side}_elbow_link", foot="{side}_ankle_link", knee="{side}_knee_link"
    ),
    tracked_bodies=(
        "pelvis",
        *both("{side}_hip_pitch_link", "{side}_knee_link", "{side}_ankle_link"),
        "torso_link",
        *both("{side}_shoulder_roll_link", "{side}_shoulder_yaw_link", "{side}_elbow_link"),
    ),
    end_effectors=(*both("{side}_ankle_link"), *both("{side}_elbow_link")),
    posture_weights={"torso": 0.2},
)
