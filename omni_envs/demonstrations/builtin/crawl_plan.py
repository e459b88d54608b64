"""What happens when in the crawl: down on hands and knees, up the slope, onto the block, up again.

The slope begins at x = 0 and rises along +x onto a block. Knees and hands move in diagonal pairs,
as people crawl.
"""

from __future__ import annotations

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.climb_plan import KNEE_HEIGHT, kneeling_foot
from omni_envs.demonstrations.builtin.limbs import FootMove, FootPose, HandMove, HandPose
from omni_envs.demonstrations.builtin.whole_body import Plan, TrunkKey

ANGLE = np.deg2rad(13.0)
"""Of the slope, rad."""

BLOCK = 0.34
"""Height of the block, m."""

TOP = BLOCK / np.tan(ANGLE)
"""x where the slope meets the block, m."""

_LEFT, _RIGHT = 0, 1
_SIDE, _KNEES, _HANDS = 0.1, 0.13, 0.19  # half the distance between feet, knees, hands, m
_BALL = 0.02
_STRIDE, _PERIOD = 0.36, 1.44  # of a knee: m and s
_AHEAD = 0.36  # hands before knees in the middle of a stride, m
_HIPS = human.THIGH + KNEE_HEIGHT + 0.02  # pelvis over the ground on hands and knees, m
_KNEE_START, _STRIDES = -0.15, 12
_DOWN = 4.2  # when crawling begins, s


def height(x: float) -> float:
    """Height of the ground at x, m."""
    return float(np.clip(x * np.tan(ANGLE), 0.0, BLOCK))


def _surface(x: float, reach: float = 0.0) -> np.ndarray:
    """(3, 3) frame of the ground from x - reach to x, z out of it."""
    slope = np.arctan2(height(x) - height(x - reach), reach) if reach else _slope(x)
    return human.turn(np.zeros(()), -slope)


def _slope(x: float) -> float:
    return float(ANGLE) if 0.0 < x < TOP else 0.0


def _knee(x: float, foot: int) -> FootPose:
    """A knee on the ground at x; the shin lies on the chord under it."""
    side = _KNEES if foot == _LEFT else -_KNEES
    return kneeling_foot((x, side, height(x)), _surface(x, 0.45))


def _palm(x: float, hand: int) -> HandPose:
    side = _HANDS if hand == _LEFT else -_HANDS
    frame = _surface(x)
    fingers, normal = frame[:, 0], -frame[:, 2]
    return HandPose(
        (x, side, height(x)),
        (float(fingers[0]), 0.0, float(fingers[2])),
        (float(normal[0]), 0.0, float(normal[2])),
    )


def _flat(x: float, foot: int) -> FootPose:
    return FootPose((x, _SIDE if foot == _LEFT else -_SIDE, height(x) + _BALL))


def plan_crawl() -> Plan:
    """Returns the plan: from standing before the slope to standing on the block."""
    d = np.deg2rad
    stand = _KNEE_START - 0.02  # balls of the feet: the knees come down a little before them
    knees = [_KNEE_START, _KNEE_START]
    palms = [_KNEE_START + _AHEAD + 0.08, _KNEE_START + _AHEAD + 0.02]
    # Down: a step back onto each knee, the hands reach for the slope.
    feet = [
        FootMove(_RIGHT, 0.9, 1.9, _knee(knees[_RIGHT], _RIGHT), (0.0, 0.0, 0.06)),
        FootMove(_LEFT, 2.1, 2.8, _knee(knees[_LEFT], _LEFT), (0.0, 0.0, 0.06)),
    ]
    hands = [
        HandMove(_LEFT, 3.0, 3.75, _palm(palms[_LEFT], _LEFT), (0.0, 0.0, 0.16)),
        HandMove(_RIGHT, 3.05, 3.8, _palm(palms[_RIGHT], _RIGHT), (0.0, 0.0, 0.16)),
    ]
    trunk = [
        TrunkKey(0.3, (stand - 0.09, 0.0), 0.915),
        TrunkKey(0.9, (stand - 0.10, 0.045), 0.89, d(6), d(8), d(15)),
        TrunkKey(1.5, (stand - 0.10, 0.05), 0.66, d(22), d(26), d(25)),
        TrunkKey(2.0, (stand - 0.16, 0.02), 0.53, d(20), d(24), d(25)),
        TrunkKey(2.5, (_KNEE_START - 0.13, -0.02), 0.50, d(10), d(14), d(20)),
        TrunkKey(2.9, (_KNEE_START - 0.10, 0.0), 0.48, d(14), d(24), d(25)),
        TrunkKey(3.45, (_KNEE_START + 0.06, 0.0), _HIPS, d(54), d(66), d(35)),
        TrunkKey(3.9, (_KNEE_START + 0.20, 0.0), _HIPS, d(68), d(82), d(40)),
    ]
    # Crawling: a knee and the other hand, then the other pair.
    t = _DOWN
    for stride in range(_STRIDES):
        knee = (_LEFT, _RIGHT)[stride % 2]
        hand = 1 - knee
        goal = knees[1 - knee] + 0.5 * _STRIDE
        knees[knee] = goal
        palms[hand] = goal + _AHEAD + 0.5 * _STRIDE
        swing = 0.5 * _PERIOD - 0.15
        feet.append(FootMove(knee, t + 0.1, t + swing, _knee(goal, knee), (0.0, 0.0, 0.045)))
        hands.append(HandMove(hand, t, t + swing - 0.08, _palm(palms[hand], hand)))
        middle = 0.5 * (knees[0] + knees[1])
        slope = float(np.arctan2(height(middle + 0.4) - height(middle), 0.4))
        trunk.append(
            TrunkKey(
                t + 0.5 * _PERIOD - 0.08,
                (middle + 0.21, 0.0),
                height(middle) + _HIPS,
                d(70) - slope,
                d(86) - slope,
                d(40),
                roll=d(3.0 if knee == _LEFT else -3.0),
            )
        )
        t += 0.5 * _PERIOD
    return _stand_up(t, knees, feet, hands, trunk, stand)


def _stand_up(
    t: float,
    knees: list[float],
    feet: list[FootMove],
    hands: list[HandMove],
    trunk: list[TrunkKey],
    stand: float,
) -> Plan:
    """From hands and knees on the block to standing there."""
    d = np.deg2rad
    last = int(np.argmin(knees))  # the knee that is behind comes up beside the other
    x = max(knees)
    feet.append(FootMove(last, t + 0.1, t + 0.6, _knee(x, last), (0.0, 0.0, 0.045)))
    top = BLOCK
    hands += [HandMove(_LEFT, t + 0.75, t + 1.3, None), HandMove(_RIGHT, t + 0.8, t + 1.35, None)]
    feet += [
        FootMove(_RIGHT, t + 2.1, t + 2.9, _flat(x + 0.30, _RIGHT), (0.0, -0.05, 0.08)),
        FootMove(_LEFT, t + 3.35, t + 4.25, _flat(x + 0.30, _LEFT), (-0.04, 0.02, 0.06)),
    ]
    trunk += [
        TrunkKey(t + 0.5, (x + 0.20, 0.0), top + _HIPS, d(68), d(86), d(40)),
        TrunkKey(t + 1.1, (x + 0.12, 0.0), top + _HIPS - 0.01, d(62), d(80), d(35)),
        TrunkKey(t + 2.0, (x - 0.08, 0.02), top + 0.466, d(4), d(8), d(15)),
        TrunkKey(t + 2.4, (x - 0.10, 0.06), top + 0.476, d(2), d(6), d(10)),
        TrunkKey(t + 2.95, (x - 0.04, 0.02), top + 0.456, d(6), d(12), d(15)),
        TrunkKey(t + 3.5, (x + 0.16, -0.05), top + 0.546, d(22), d(30), d(20)),
        TrunkKey(t + 4.05, (x + 0.21, -0.06), top + 0.746, d(14), d(20), d(15)),
        TrunkKey(t + 4.8, (x + 0.21, 0.0), top + 0.915),
    ]
    start = _flat(stand, _LEFT), _flat(stand, _RIGHT)
    return Plan(start, tuple(feet), tuple(hands), tuple(trunk), t + 5.3)
