"""Paths of feet and hands from one planted pose to the next, on any surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omni_envs.demonstrations.builtin import human
from omni_envs.demonstrations.builtin.motion import bump, ramp

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class FootPose:
    """A foot and its knee.

    Attributes:
        ball: Joint at the ball of the foot, m.
        yaw: Heading, rad.
        pitch: Heel up is positive, rad.
        toes: How much of the pitch the toes share: 0 where they lie flat under a raised heel.
        out: How far the knee points outward of the heading, rad.
        knee: Where the knee rests, or None while it rests on nothing.
    """

    ball: Vector
    yaw: float = 0.0
    pitch: float = 0.0
    toes: float = 0.0
    out: float = 0.1
    knee: Vector | None = None


@dataclass(frozen=True)
class HandPose:
    """A hand on a surface.

    Attributes:
        palm: Skin of the palm, m.
        fingers: Direction of the fingers.
        normal: Direction that the palm faces.
    """

    palm: Vector
    fingers: Vector = (1.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class FootMove:
    """A foot goes somewhere.

    Attributes:
        foot: 0 left, 1 right.
        start: When it leaves, s.
        stop: When it arrives, s.
        to: Where it arrives.
        lift: By how much the path is raised in its middle, m.
    """

    foot: int
    start: float
    stop: float
    to: FootPose
    lift: Vector = (0.0, 0.0, 0.06)


@dataclass(frozen=True)
class HandMove:
    """A hand goes somewhere; ``to`` None lets it hang.

    Attributes:
        hand: 0 left, 1 right.
        start: When it leaves, s.
        stop: When it arrives, s.
        to: Where it arrives.
        lift: By how much the path is raised in its middle, m.
    """

    hand: int
    start: float
    stop: float
    to: HandPose | None
    lift: Vector = (0.0, 0.0, 0.05)


@dataclass(frozen=True)
class Legs:
    """Paths of both feet and knees.

    Attributes:
        feet: The feet.
        out: (T, 2) how far the knees point outward, rad.
        knees: (T, 2, 3) where the knees rest, or rested last, or will first, m.
        kneeling: (T, 2) in [0, 1]: how much the knee rests there.
        towards: (T, 2) in [0, 1]: how much the leg bends towards that place.
    """

    feet: human.Feet
    out: np.ndarray
    knees: np.ndarray
    kneeling: np.ndarray
    towards: np.ndarray


def leg_paths(time: np.ndarray, start: Sequence[FootPose], moves: Sequence[FootMove]) -> Legs:
    """Joins the moves of both feet (T,), in the order of time; a foot without a move is still."""
    frames = len(time)
    toes, knees = np.empty((frames, 2, 3)), np.empty((frames, 2, 3))
    angles = np.empty((4, frames, 2))  # yaw, pitch, toes, out
    kneeling, towards = np.empty((2, frames, 2))
    for foot in range(2):
        pose, own = start[foot], [m for m in moves if m.foot == foot]
        known = [p.knee for p in (pose, *(m.to for m in own)) if p.knee is not None]
        knee = np.array(known[0] if known else pose.ball, float)
        toes[:, foot], knees[:, foot] = pose.ball, knee
        angles[:, :, foot] = np.array(_angles(pose))[:, None]
        kneeling[:, foot] = towards[:, foot] = float(pose.knee is not None)
        for move in own:
            share = ramp(time, move.start, move.stop)
            raised = bump(time, move.start, move.stop)[:, None] * move.lift
            toes[:, foot] += share[:, None] * np.subtract(move.to.ball, pose.ball) + raised
            change = np.subtract(_angles(move.to), _angles(pose))
            angles[:, :, foot] += share * change[:, None]
            before, after = float(pose.knee is not None), float(move.to.knee is not None)
            # In mid-air the knee is free; between two rests it swings from one to the other.
            third = 0.35 * (move.stop - move.start)
            kneeling[:, foot] += after * ramp(time, move.stop - third, move.stop)
            kneeling[:, foot] -= before * ramp(time, move.start, move.start + third)
            towards[:, foot] += (after - before) * share
            if move.to.knee is not None:
                if before:
                    knees[:, foot] += share[:, None] * np.subtract(move.to.knee, knee) + raised
                else:  # it rests nowhere on the way: the new place counts from the start
                    late = time >= move.start
                    knees[late, foot] = move.to.knee
                knee = np.array(move.to.knee)
            pose = move.to
    yaw, pitch, bend, out = angles
    return Legs(human.Feet(toes, yaw, pitch, bend), out, knees, kneeling, towards)


def _angles(pose: FootPose) -> tuple[float, float, float, float]:
    return pose.yaw, pose.pitch, pose.toes, pose.out


def hand_paths(
    time: np.ndarray, moves: Sequence[HandMove]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Joins the moves of both hands, which hang at first.

    Returns:
        (T, 2) hold in [0, 1], 0 while a hand hangs; (T, 2, 3) palms, finger directions and palm
        normals where it is held, not unit on the way.
    """
    frames = len(time)
    hold = np.zeros((frames, 2))
    paths = np.zeros((3, frames, 2, 3))
    paths[1], paths[2] = (0.0, 0.0, -1.0), (0.0, 0.0, -1.0)
    for hand in range(2):
        pose: HandPose | None = None
        for move in (m for m in moves if m.hand == hand):
            share = ramp(time, move.start, move.stop)[:, None]
            raised = bump(time, move.start, move.stop)[:, None] * move.lift
            if move.to is None:
                hold[:, hand] -= share[:, 0]
            else:
                new = (move.to.palm, move.to.fingers, move.to.normal)
                if pose is None:
                    hold[:, hand] += share[:, 0]
                    late = time >= move.start
                    for path, value in zip(paths, new, strict=True):
                        path[late, hand] = value
                else:
                    old = (pose.palm, pose.fingers, pose.normal)
                    for path, value, last in zip(paths, new, old, strict=True):
                        path[:, hand] += share * np.subtract(value, last)
            paths[0, :, hand] += raised
            pose = move.to
    return hold, *paths
