"""What happens when in the climb: footsteps, holds and leans on the way up.

The platform's front edge is at x = 0. The climber walks up to it, lays both hands on top, sets one
foot against the wall, pushes up until the arms are straight, brings the other knee over the edge,
crawls on, straightens up on both knees, puts one foot forward and stands.
"""

from __future__ import annotations

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.limbs import FootMove, FootPose, HandMove, HandPose, Vector
from omni_envs.demonstrations.builtin.whole_body import Plan, TrunkKey

PLATFORM = 0.7 * human.HEIGHT
"""Height of the platform, m."""

KNEE_HEIGHT = 0.05
"""Of the knee joint over what it kneels on, m."""

_LEFT, _RIGHT = 0, 1
_SIDE = 0.1  # half the distance between standing feet, m
_BALL = 0.02  # height of the ball joint over the ground, m
_TUCKED = np.deg2rad(108.0)  # pitch of a kneeling foot


def ankle_foot(ankle: Vector, pitch: float, out: float = 0.1) -> FootPose:
    """A foot in the air, by its ankle."""
    ball = np.array(ankle) - human.turn(np.zeros(()), pitch) @ human.ANKLE_FROM_TOE
    return FootPose(_vector(ball), pitch=pitch, toes=1.0, out=out)


def kneeling_foot(
    knee: Vector, surface: np.ndarray | None = None, pitch: float = _TUCKED
) -> FootPose:
    """A foot whose knee and toes rest on a surface.

    Args:
        knee: Place of the knee on the surface, m.
        surface: (3, 3) frame of the surface, z out of it; None is level.
        pitch: Of the foot against the surface, rad.
    """
    frame = np.eye(3) if surface is None else surface
    to_ankle = human.turn(np.zeros(()), pitch) @ human.ANKLE_FROM_TOE
    # In the frame of the surface, from the place of the knee.
    rise = _BALL + to_ankle[2] - KNEE_HEIGHT
    back = np.sqrt(human.SHIN**2 - rise**2)
    ball = frame @ [-back - to_ankle[0], 0.0, _BALL]
    up = frame @ [0.0, 0.0, KNEE_HEIGHT]
    slope = float(np.arctan2(-frame[2, 0], frame[0, 0]))
    return FootPose(
        _vector(knee + ball),
        pitch=pitch + slope,
        toes=slope / (pitch + slope),
        knee=_vector(knee + up),
    )


def _vector(v: np.ndarray) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])


def plan_ascent() -> Plan:
    """Returns the way up, from standing before the platform to standing on it."""
    top = PLATFORM

    def flat(x: float, side: float, z: float = 0.0) -> FootPose:
        return FootPose((x, side, z + _BALL))

    def palm(x: float, side: float) -> HandPose:
        return HandPose((x, side, top))

    def kneel(x: float, side: float) -> FootPose:
        return kneeling_foot((x, side, top))

    wall = FootPose((-0.022, -0.14, 0.63), pitch=np.deg2rad(-58.0), toes=1.0, out=0.75)
    hanging = ankle_foot((-0.50, 0.13, 0.55), np.deg2rad(45.0), out=0.35)
    feet = (
        FootMove(_LEFT, 0.5, 1.0, flat(-0.62, _SIDE)),
        FootMove(_RIGHT, 1.1, 1.6, flat(-0.36, -_SIDE)),
        FootMove(_LEFT, 1.7, 2.2, flat(-0.36, _SIDE)),
        FootMove(_RIGHT, 3.0, 3.7, wall, (-0.10, 0.0, 0.0)),
        FootMove(_LEFT, 4.1, 5.0, hanging, (-0.05, 0.0, 0.0)),
        FootMove(_LEFT, 5.0, 6.1, _over_edge((0.21, 0.17, top)), (-0.06, 0.16, 0.18)),
        FootMove(_RIGHT, 6.15, 7.15, _over_edge((0.23, -0.15, top)), (-0.10, -0.14, 0.14)),
        FootMove(_LEFT, 7.6, 8.3, kneel(0.52, 0.14), (0.0, 0.0, 0.08)),
        FootMove(_RIGHT, 8.5, 9.2, kneel(0.70, -0.13), (0.0, 0.0, 0.08)),
        FootMove(_LEFT, 9.3, 9.8, kneel(0.70, 0.13), (0.0, 0.0, 0.05)),
        FootMove(_RIGHT, 11.2, 12.0, flat(1.00, -0.11, top), (0.0, -0.06, 0.08)),
        FootMove(_LEFT, 12.6, 13.4, flat(1.00, 0.10, top), (-0.04, 0.02, 0.06)),
    )
    hands = (
        HandMove(_RIGHT, 2.1, 2.7, palm(0.11, -0.22)),
        HandMove(_LEFT, 2.35, 2.95, palm(0.11, 0.22)),
        HandMove(_LEFT, 5.95, 6.35, palm(0.45, 0.23)),
        HandMove(_RIGHT, 7.05, 7.5, palm(0.72, -0.22)),
        HandMove(_LEFT, 7.35, 7.75, palm(0.90, 0.22)),
        HandMove(_RIGHT, 8.15, 8.6, palm(1.10, -0.22)),
        HandMove(_LEFT, 9.1, 9.55, palm(1.12, 0.22)),
        HandMove(_LEFT, 9.9, 10.5, None),
        HandMove(_RIGHT, 9.95, 10.55, None),
    )
    d = np.deg2rad
    trunk = (
        TrunkKey(0.3, (-0.90, 0.0), 0.915),
        TrunkKey(0.6, (-0.87, -0.035), 0.905, d(2), d(2)),
        TrunkKey(1.1, (-0.72, 0.03), 0.905, d(3), d(3)),
        TrunkKey(1.7, (-0.52, -0.035), 0.905, d(3), d(3)),
        TrunkKey(2.3, (-0.44, 0.0), 0.91, d(3), d(5)),
        TrunkKey(2.9, (-0.43, 0.04), 0.90, d(6), d(8)),
        TrunkKey(3.3, (-0.43, 0.07), 0.89, d(2), d(6)),
        TrunkKey(4.0, (-0.42, 0.03), 0.88, d(2), d(8), d(15)),
        TrunkKey(4.9, (-0.31, -0.04), 1.25, d(22), d(25), d(20)),
        TrunkKey(5.4, (-0.20, -0.04), 1.35, d(42), d(48), d(30), roll=d(6)),
        TrunkKey(6.0, (-0.05, 0.0), 1.40, d(52), d(57), d(30), roll=d(4)),
        TrunkKey(6.6, (0.15, 0.02), 1.57, d(64), d(72), d(40), roll=d(-3)),
        TrunkKey(7.4, (0.37, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(8.0, (0.48, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(8.35, (0.61, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(8.55, (0.62, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(8.85, (0.69, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(9.2, (0.83, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(9.4, (0.84, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(9.8, (0.86, 0.0), 1.665, d(70), d(90), d(40)),
        TrunkKey(10.2, (0.80, 0.0), 1.64, d(64), d(82), d(35)),
        TrunkKey(11.1, (0.62, 0.02), 1.67, d(4), d(8), d(15)),
        TrunkKey(11.5, (0.60, 0.06), 1.68, d(2), d(6), d(10)),
        TrunkKey(12.05, (0.66, 0.02), 1.66, d(6), d(12), d(15)),
        TrunkKey(12.6, (0.86, -0.05), 1.78, d(22), d(30), d(20)),
        TrunkKey(13.1, (0.91, -0.06), 1.96, d(14), d(20), d(15)),
        TrunkKey(13.9, (0.91, 0.0), top + 0.915),
    )
    return Plan((flat(-0.86, _SIDE), flat(-0.86, -_SIDE)), feet, hands, trunk, 14.2)


def _over_edge(knee: Vector, raised: float = np.deg2rad(22.0)) -> FootPose:
    """A foot in the air behind the edge, its shin raised: it must not catch on the edge."""
    x, y, z = knee
    back, up = human.SHIN * np.cos(raised), KNEE_HEIGHT + human.SHIN * np.sin(raised)
    foot = ankle_foot((x - float(back), y, z + float(up)), np.deg2rad(115.0) + raised)
    return FootPose(foot.ball, pitch=foot.pitch, toes=1.0, knee=(x, y, z + KNEE_HEIGHT))
