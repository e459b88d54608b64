"""Smooth curves, footsteps and balance: the parts that a made motion is put together from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import solve_banded

GRAVITY = 9.81


def ramp(time: np.ndarray, start: float, stop: float) -> np.ndarray:
    """Minimum-jerk step from 0 at ``start`` to 1 at ``stop``: twice continuously differentiable."""
    u = np.clip((time - start) / (stop - start), 0.0, 1.0)
    return u**3 * (10.0 + u * (6.0 * u - 15.0))


def bump(time: np.ndarray, start: float, stop: float) -> np.ndarray:
    """Smooth hill from 0 at ``start`` over 1 in the middle to 0 at ``stop``."""
    u = np.clip((time - start) / (stop - start), 0.0, 1.0)
    return (4.0 * u * (1.0 - u)) ** 3


def keyframes(time: np.ndarray, keys: Sequence[tuple[float, float]]) -> np.ndarray:
    """Minimum-jerk curve through (time, value) keys, at rest in each."""
    value = np.full(len(time), keys[0][1], float)
    for (t0, v0), (t1, v1) in pairwise(keys):
        if v1 != v0:
            value += (v1 - v0) * ramp(time, t0, t1)
    return value


@dataclass(frozen=True)
class Step:
    """One footstep.

    Attributes:
        foot: 0 left, 1 right.
        lift: Time when the ball of the foot leaves the ground, s.
        land: Time when the foot touches down, s.
        ball: (x, y) where the ball of the foot comes to stand, m.
        yaw: Heading of the foot there, rad.
        heel_off: Heel-up pitch at which the foot pushes off, rad.
        heel_strike: Toe-up pitch at which it touches down, rad.
    """

    foot: int
    lift: float
    land: float
    ball: tuple[float, float]
    yaw: float
    heel_off: float = 0.30
    heel_strike: float = 0.14


@dataclass(frozen=True)
class FootShape:
    """Side view of a foot from the ball (under the toe joint), foot pointing along +x, m.

    Attributes:
        ball_height: Height of the toe joint over the sole.
        heel: How far the back of the sole is behind the ball.
    """

    ball_height: float = 0.02
    heel: float = 0.185


def foot_paths(
    time: np.ndarray,
    steps: Sequence[Step],
    start: Sequence[tuple[float, float]],
    clearance: float,
    shape: FootShape,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Paths of both feet.

    A standing foot is exactly still. Before it lifts, the heel rises about the ball; it lands on
    the heel and rolls flat about it.

    Returns:
        (T, 2, 3) toe joints, (T, 2) yaw, (T, 2) pitch (heel up is positive), and (T, 2) bend in
        [0, 1]: how much of the pitch the toes share (0 on the ground while the heel rises).
    """
    ball = np.empty((len(time), 2, 3))
    yaw, pitch, share = np.zeros((3, len(time), 2))
    for foot in range(2):
        x, y = start[foot]
        ball[:, foot] = x, y, shape.ball_height
        heading = 0.0
        for step in (s for s in steps if s.foot == foot):
            swing = step.land - step.lift
            flat = step.land + 0.16
            pitch[:, foot] += keyframes(
                time,
                [
                    (step.lift - 0.22, 0.0),
                    (step.lift + 0.12 * swing, step.heel_off),
                    (step.land - 0.02, -step.heel_strike),
                    (flat, 0.0),
                ],
            )
            share[:, foot] += ramp(time, step.lift, step.lift + 0.35 * swing)
            share[:, foot] -= ramp(time, flat, flat + 0.05)
            move = ramp(time, step.lift, step.land)
            ball[:, foot, 0] += (step.ball[0] - x) * move
            ball[:, foot, 1] += (step.ball[1] - y) * move
            ball[:, foot, 2] += clearance * bump(time, step.lift, step.land)
            yaw[:, foot] += (step.yaw - heading) * move
            # The ball is up by the pitch about the heel until the foot is flat.
            toe_up = np.where(
                time > 0.5 * (step.lift + step.land), np.maximum(-pitch[:, foot], 0), 0
            )
            toe_up = np.where(time < flat, toe_up, 0.0)
            back = shape.heel * (np.cos(toe_up) - 1.0) - shape.ball_height * np.sin(toe_up)
            ball[:, foot, 0] += back * np.cos(step.yaw)
            ball[:, foot, 1] += back * np.sin(step.yaw)
            ball[:, foot, 2] += shape.heel * np.sin(toe_up)
            ball[:, foot, 2] += shape.ball_height * (np.cos(toe_up) - 1.0)
            (x, y), heading = step.ball, step.yaw
    return ball, yaw, pitch, share


def support_weights(time: np.ndarray, steps: Sequence[Step], settle: float = 0.45) -> np.ndarray:
    """Share of the body weight on the right foot, (T,): 0 while the right foot swings, 1 the left.

    Between steps the weight moves during double support; before the first of a walk and after the
    last it takes ``settle`` seconds.
    """
    keys = [(float(time[0]) - 1.0, 0.5)]
    for step in sorted(steps, key=lambda s: s.lift):
        weight = 1.0 if step.foot == 0 else 0.0
        if keys[-1][0] + 2 * settle < step.lift:
            if keys[-1][1] != 0.5:
                keys.append((keys[-1][0] + settle, 0.5))
            keys.append((step.lift - settle, 0.5))
        keys += [(step.lift, weight), (step.land, weight)]
    if steps:
        keys.append((keys[-1][0] + settle, 0.5))
    return keyframes(time, keys)


def pressure_points(
    time: np.ndarray, steps: Sequence[Step], rest: float = 0.085, push: float = 0.01
) -> np.ndarray:
    """How far behind the ball each foot carries its weight, (T, 2), m.

    ``rest`` while it stands flat; under the ball, ``push``, from when the heel rises.
    """
    behind = np.full((len(time), 2), rest)
    for step in steps:
        forward = ramp(time, step.lift - 0.42, step.lift - 0.17) - ramp(time, step.lift, step.land)
        behind[:, step.foot] -= (rest - push) * forward * min(1.0, step.heel_off / 0.2)
    return behind


def balanced_com(zmp: np.ndarray, dt: float, height: float) -> np.ndarray:
    """The bounded path of the centre of mass whose zero-moment point is the given one.

    Solves c − (h / g) c̈ = p of the linear inverted pendulum on the whole interval at once, at rest
    at both ends.

    Args:
        zmp: (T, 2) zero-moment point on the ground, m.
        dt: Time step, s.
        height: Height of the centre of mass, m.

    Returns:
        (T, 2) horizontal path of the centre of mass, m.
    """
    frames, k = len(zmp), height / GRAVITY / dt**2
    bands = np.empty((3, frames))
    bands[0], bands[1], bands[2] = -k, 1.0 + 2.0 * k, -k
    bands[1, [0, -1]] = 1.0 + k
    return solve_banded((1, 1), bands, zmp)
