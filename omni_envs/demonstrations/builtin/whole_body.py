"""A body that moves on feet, knees and hands: limbs are planned, the trunk is solved for.

Feet, resting knees and held hands are where the plan puts them; keyframes say where the centre of
mass, the height and the lean of the trunk should be. The pelvis is the least-squares compromise in
which resting knees and the reach of the limbs come first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.limbs import (
    FootMove,
    FootPose,
    HandMove,
    Legs,
    hand_paths,
    leg_paths,
)

_FIRM = 30.0  # weight of knees and reach against the wish for balance and height
_BALANCE = (1.0, 4.0)  # knees on the ground leave more room ahead than aside
_LEG = 0.985 * (human.THIGH + human.SHIN)
_ARM = 0.975 * (human.UPPER_ARM + human.FOREARM)
_UP = np.array([0.0, 0.0, 0.6])  # a folded leg has its knee up
_SMOOTH = (0.2, 0.12, 0.08)  # s


@dataclass(frozen=True)
class TrunkKey:
    """What the trunk should do at a time; between keys it moves smoothly.

    Attributes:
        time: s.
        com: (x, y) of the centre of mass, m.
        height: Of the pelvis joint, m.
        pelvis: Forward lean of the pelvis, rad.
        chest: Forward lean of the chest, rad.
        head: Forward lean of the head, rad.
        roll: Of the pelvis, left side up, rad.
        yaw: Heading of the pelvis, rad; the chest turns against it by as much.
    """

    time: float
    com: tuple[float, float]
    height: float
    pelvis: float = 0.0
    chest: float = 0.0
    head: float = 0.1
    roll: float = 0.0
    yaw: float = 0.0


@dataclass(frozen=True)
class Plan:
    """A motion on feet, knees and hands.

    Attributes:
        start: Both feet at first.
        feet: Moves of the feet, in the order of time.
        hands: Moves of the hands, in the order of time; they hang at first.
        trunk: Keyframes, in the order of time.
        end: Length of the motion, s.
    """

    start: tuple[FootPose, FootPose]
    feet: tuple[FootMove, ...]
    hands: tuple[HandMove, ...]
    trunk: tuple[TrunkKey, ...]
    end: float


def perform(plan: Plan, time: np.ndarray) -> dict[str, np.ndarray]:
    """Performs a plan at (T,) even times, s.

    Returns:
        Joints of ``human.JOINTS`` to (T, 3) positions, m.
    """
    keys = np.array(
        [(*k.com, k.height, k.pelvis, k.chest, k.head, k.roll, k.yaw) for k in plan.trunk]
    )
    track = PchipInterpolator([k.time for k in plan.trunk], keys)
    inside = np.clip(time, plan.trunk[0].time, plan.trunk[-1].time)
    wish = gaussian_filter1d(track(inside), 0.08 / (time[1] - time[0]), axis=0, mode="nearest")
    com, height = wish[:, :2], wish[:, 2]
    pelvis_pitch, chest_pitch, head_pitch, roll, yaw = wish[:, 3:].T
    pelvis_turn = np.stack([yaw, pelvis_pitch, roll], axis=-1)
    chest_turn = np.stack([-yaw, chest_pitch, -0.5 * roll], axis=-1)
    head_turn = np.stack([0 * yaw, head_pitch, 0 * yaw], axis=-1)
    legs = leg_paths(time, plan.start, plan.feet)
    held = hand_paths(time, plan.hands)
    reach = 0.03 * held[0].mean(axis=1)

    def pose(pelvis: np.ndarray) -> dict[str, np.ndarray]:
        joints = human.torso(pelvis, pelvis_turn, chest_turn, head_turn, reach)
        _add_legs(joints, legs)
        human.add_arms(joints, _hands(joints, legs, held))
        return joints

    def firm(joints: dict[str, np.ndarray]) -> list[np.ndarray]:
        """What comes first: knees that rest, and limbs that are not longer than they are."""
        rows = []
        for i, side in enumerate("LR"):
            hip, ankle = joints[f"{side}_Hip"], joints[f"{side}_Ankle"]
            thigh = np.linalg.norm(legs.knees[:, i] - hip, axis=1) - human.THIGH
            rows.append(_FIRM * legs.kneeling[:, i] * thigh)
            rows.append(_FIRM * _excess(np.linalg.norm(hip - ankle, axis=1) - _LEG))
            arm = np.linalg.norm(joints[f"{side}_Shoulder"] - joints[f"{side}_Wrist"], axis=1)
            rows.append(_FIRM * held[0][:, i] * _excess(arm - _ARM))
        return rows

    def balanced(pelvis: np.ndarray) -> np.ndarray:
        joints = pose(pelvis)
        off = human.centre_of_mass(joints)[:, :2] - com
        return np.column_stack([off * _BALANCE, pelvis[:, 2] - height, *firm(joints)])

    pelvis = np.column_stack([com, height])
    pelvis[:, 0] -= 0.3 * np.sin(chest_pitch)  # a first guess
    pelvis = _solve(balanced, pelvis, 12)
    for seconds in _SMOOTH:
        smooth = gaussian_filter1d(pelvis, seconds / (time[1] - time[0]), axis=0, mode="nearest")
        near = partial(_near, smooth, lambda p: firm(pose(p)))
        pelvis = _solve(near, smooth, 6)
    return pose(pelvis)


def _near(
    place: np.ndarray, firm: Callable[[np.ndarray], list[np.ndarray]], pelvis: np.ndarray
) -> np.ndarray:
    return np.column_stack([(pelvis - place) * (*_BALANCE, 1.0), *firm(pelvis)])


def _solve(
    residuals: Callable[[np.ndarray], np.ndarray], start: np.ndarray, iterations: int
) -> np.ndarray:
    """Gauss-Newton for (T, 3) values on every frame at once."""
    value = start
    for _ in range(iterations):
        r = residuals(value)
        J = np.stack([(residuals(value + d) - r) / 1e-5 for d in 1e-5 * np.eye(3)], axis=2)
        normal = np.swapaxes(J, 1, 2) @ J + 1e-2 * np.eye(3)
        step = np.linalg.solve(normal, -np.einsum("tri,tr->ti", J, r)[..., None])[..., 0]
        value = value + np.clip(step, -0.1, 0.1)
    return value


def _excess(value: np.ndarray, width: float = 0.01) -> np.ndarray:
    """Positive part with a rounded corner: what limits reach must not start with a jerk."""
    return 0.5 * (value + np.sqrt(value * value + width * width))


def _add_legs(joints: dict[str, np.ndarray], legs: Legs) -> None:
    human.add_legs(joints, legs.feet, 0.0 * legs.out[:, 0])
    for i, (side, sign) in enumerate((("L", 1.0), ("R", -1.0))):
        hip, ankle = joints[f"{side}_Hip"], joints[f"{side}_Ankle"]
        ahead = human.turn(legs.feet.yaw[:, i] + sign * legs.out[:, i])[..., 0]
        down = unit(legs.knees[:, i] - hip)
        share = legs.towards[:, i, None]
        pole = (1 - share) * (ahead + _UP) + share * down
        joints[f"{side}_Knee"] = human.two_links(hip, ankle, (human.THIGH, human.SHIN), pole)


def _hands(joints: dict[str, np.ndarray], legs: Legs, held: tuple[np.ndarray, ...]) -> human.Hands:
    """Hands that hang and swing with the stride, or are where the plan puts them."""
    hold, palms, fingers, normals = held
    stride = legs.feet.toes[:, 0, 0] - legs.feet.toes[:, 1, 0]
    wrists, points, faces, poles = np.empty((4, len(hold), 2, 3))
    for i, sign in enumerate((1.0, -1.0)):
        w = hold[:, i, None]
        swing = np.deg2rad(-2.0) - sign * 0.5 * np.clip(stride, -0.4, 0.4)
        bend = swing + np.deg2rad(20.0)
        aside = np.full_like(swing, sign * 0.17)
        upper = unit(np.stack([np.sin(swing), aside, -np.cos(swing)], axis=-1))
        lower = unit(np.stack([np.sin(bend), 0.3 * aside, -np.cos(bend)], axis=-1))
        hanging = joints[f"{'LR'[i]}_Shoulder"] + human.UPPER_ARM * upper + human.FOREARM * lower
        along = unit(fingers[:, i])
        facing = unit(normals[:, i])
        there = palms[:, i] - human.PALM * along - human.PALM_DEPTH * facing
        wrists[:, i] = hanging + w * (there - hanging)
        points[:, i] = unit((1 - w) * lower + w * along)
        across = (1 - w) * np.array([0.0, -sign, 0.0]) + w * facing
        across = across - np.sum(across * points[:, i], axis=-1, keepdims=True) * points[:, i]
        faces[:, i] = unit(across)
        poles[:, i] = np.array([-1.0, 0.25 * sign, -0.3]) + w * [0.4, 0.45 * sign, 0.0]
    return human.Hands(wrists, points, faces, poles)


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors (…, 3) of length 1."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def joints_of(names: Sequence[str], joints: dict[str, np.ndarray]) -> np.ndarray:
    """(T, J, 3) positions of the named joints."""
    return np.stack([joints[name] for name in names], axis=1)
