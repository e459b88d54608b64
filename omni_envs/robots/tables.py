"""What tables of robots share: names that come once per side, and drives of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from omni_envs.robots.robot import SIDES, Actuator


@dataclass(frozen=True)
class Drive:
    """What drives a joint.

    Attributes:
        effort: Torque limit, N m.
        speed: Speed limit, rad/s.
        stiffness: kp, N m / rad.
        damping: kd, N m s / rad.
        armature: Reflected rotor inertia, kg m².
    """

    effort: float
    speed: float
    stiffness: float
    damping: float
    armature: float

    def actuator(self, joint: str) -> Actuator:
        """Returns the actuator of a joint that this drives."""
        return Actuator(joint, self.stiffness, self.damping, self.effort, self.speed, self.armature)


def sided(pattern: str, side: str, **names: str) -> str:
    """The name of one side.

    Args:
        pattern: ``{side}`` becomes ``left``, ``{Side}`` ``Left``, ``{S}`` ``L``.
        side: ``"left"`` or ``"right"``.
        names: Further fields of the pattern.
    """
    return pattern.format(side=side, Side=side.capitalize(), S=side[0].upper(), **names)


def both(*patterns: str) -> tuple[str, ...]:
    """Names of both sides: all of the left one first."""
    return tuple(sided(pattern, side) for side in SIDES for pattern in patterns)


def same(pattern: str, **values: float) -> dict[str, float]:
    """Values that are the same on both sides; ``{joint}`` of the pattern becomes the key."""
    return {
        sided(pattern, side, joint=joint): value
        for side in SIDES
        for joint, value in values.items()
    }


def limb(pattern: str, side: str, drives: Mapping[str, Drive]) -> tuple[Actuator, ...]:
    """Actuators of an arm or a leg; ``{joint}`` of the pattern becomes the key."""
    return tuple(
        drive.actuator(sided(pattern, side, joint=joint)) for joint, drive in drives.items()
    )


def contact_links(**bodies: str) -> dict[str, tuple[str, ...]]:
    """Contact links of both sides from the patterns of ``hand``, ``foot`` and ``knee``."""
    return {
        f"{side}_{link}": (sided(pattern, side),)
        for side in SIDES
        for link, pattern in bodies.items()
    }
