"""Axes, units and height of a recording, found from the person in it.

Everything is judged by the 15 keypoints, in the file's own axes and units: legs have a length that
only one unit makes human, shoulders are above feet, and toes point forward.
"""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np

from omni_envs.demonstrations.source_options import METRES, Unit, UpAxis
from omni_envs.errors import FileFormatError
from omni_envs.robots import KEYPOINTS, SIDES

LEG = (0.55, 1.10)
"""Thigh and shin of a grown person together, m. The ranges of two units never overlap."""

LEG_PER_HEIGHT = 0.491
"""Thigh and shin over standing height (Winter, Biomechanics and Motor Control, table 4.1)."""

ANKLE_HEIGHT, SCALP = 0.08, 0.01
"""What a skeleton from ankle joint to crown leaves out below and above, m."""

_UP_ROTATIONS: dict[UpAxis, tuple[tuple[int, int, int], tuple[float, float, float]]] = {
    "z": ((0, 1, 2), (1.0, 1.0, 1.0)),
    "y": ((0, 2, 1), (1.0, -1.0, 1.0)),
    "x": ((1, 2, 0), (1.0, 1.0, 1.0)),
    "-z": ((0, 1, 2), (1.0, -1.0, -1.0)),
    "-y": ((0, 2, 1), (1.0, 1.0, -1.0)),
    "-x": ((2, 1, 0), (1.0, 1.0, -1.0)),
}  # for every axis a rotation that takes it to +z: permuted columns and their signs
_AXES: tuple[UpAxis, ...] = ("x", "y", "z")

_ABOVE = 0.1  # legs; shoulders of someone who crawls are, on average, still this high
_UPRIGHT = 0.7  # legs; shoulders that are on average this high above the ankles stand
_BACKWARDS = -0.3  # mean cosine between forward and the toes; −0.9 for a mirrored walk
_CLEAR = 3.0  # times the next; by so much does one axis have to win


def turn_up(points: np.ndarray, up: UpAxis) -> np.ndarray:
    """Rotates (…, 3) points so that the axis ``up`` of the file becomes z.

    ``"y"`` takes (x, y, z) to (x, −z, y): a rotation, which keeps left on the left.
    """
    columns, signs = _UP_ROTATIONS[up]
    return points[..., columns] * np.array(signs)


def leg_length(keypoints: np.ndarray) -> float:
    """Thigh and shin, median over the frames and mean of both legs, in units of the file.

    Args:
        keypoints: (T, 15, 3) in the order of ``KEYPOINTS``.
    """
    lengths = []
    for side in SIDES:
        hip, knee, ankle = (_point(keypoints, f"{side}_{p}") for p in ("hip", "knee", "ankle"))
        bones = np.linalg.norm(hip - knee, axis=-1), np.linalg.norm(knee - ankle, axis=-1)
        lengths.append(sum(float(np.median(bone)) for bone in bones))
    return float(np.mean(lengths))


def find_unit(path: Path, leg: float) -> Unit:
    """The unit in which a leg is between 0.55 and 1.10 m long.

    Raises:
        FileFormatError: No unit makes the leg human.
    """
    for unit, metres in METRES.items():
        if LEG[0] <= leg * metres <= LEG[1]:
            return unit
    ranges = ", ".join(f"{LEG[0] / m:.3g} to {LEG[1] / m:.3g} ({u})" for u, m in METRES.items())
    expected = f"thigh and shin of {ranges}; or the option unit"
    raise FileFormatError(path, "unit of length", expected, f"{leg:.4g} in the file")


def find_up(
    keypoints: np.ndarray, positions: np.ndarray, rest: np.ndarray | None, leg: float
) -> UpAxis | None:
    """Finds the axis that points up.

    Candidates are the axes along which shoulders are, on average, above ankles by a tenth of a leg,
    and the axis of a rest skeleton that stands straight. Of several the one wins on which the
    lowest joint stays most constant, for the ground does, if it is three times as constant as on
    any other; else the rest skeleton's; else the one along which shoulders are above ankles by 0.7
    legs, and three times as far as along any other.

    Args:
        keypoints: (T, 15, 3) in the file's axes and units.
        positions: (T, J, 3) all joints.
        rest: (15, 3) keypoints of the rest skeleton, or None.
        leg: Leg length in the file's units.

    Returns:
        The axis, or None where the recording does not tell.
    """
    standing = None if rest is None else rest_up(rest, leg)
    trunk = np.mean(_middle(keypoints, "shoulder") - _middle(keypoints, "ankle"), axis=0) / leg
    signs = np.where(trunk < 0, -1.0, 1.0)
    unrest = np.std(np.min(signs * positions, axis=1), axis=0) / leg
    likely = [axis for axis in range(3) if abs(trunk[axis]) > _ABOVE]
    candidates = {_signed(axis, signs[axis]): float(unrest[axis]) for axis in likely}
    if standing is not None:
        axis = _AXES.index(standing[-1])
        candidates.setdefault(standing, float(unrest[axis]))
    if not candidates:
        return None
    best = min(candidates, key=lambda up: candidates[up])
    others = [value for up, value in candidates.items() if up != best]
    if not others or _CLEAR * candidates[best] < min(others):
        return best
    if standing is not None:
        return standing
    first, second = np.argsort(-np.abs(trunk))[:2]
    if abs(trunk[first]) > max(_UPRIGHT, _CLEAR * abs(trunk[second])):
        return _signed(int(first), signs[first])
    return None


def rest_up(rest: np.ndarray, leg: float) -> UpAxis | None:
    """The axis along which a rest skeleton (15, 3) stands straight; None where it does not."""
    hips, ankles, shoulders = (_middle(rest, part) for part in ("hip", "ankle", "shoulder"))
    trunk = (shoulders - ankles) / leg
    axis = int(np.argmax(np.abs(trunk)))
    sign = float(np.sign(trunk[axis]))
    straight = np.abs(trunk[axis]) > 0.95 * np.linalg.norm(trunk)
    above = sign * (hips - ankles)[axis] > 0.6 * leg
    upright = straight and above and sign * (shoulders - hips)[axis] > 0.2 * leg
    return _signed(axis, sign) if upright else None


def check_sides(path: Path, keypoints: np.ndarray) -> None:
    """Checks that left is left: forward, by hips and spine, is where the toes point.

    Args:
        path: The file, for error messages.
        keypoints: (T, 15, 3), z up.

    Raises:
        FileFormatError: The person is mirrored, or left and right are exchanged.
    """
    across = _point(keypoints, "left_hip") - _point(keypoints, "right_hip")
    spine = _middle(keypoints, "shoulder") - _middle(keypoints, "hip")
    forward = np.cross(across, spine)
    toes = _middle(keypoints, "toe") - _middle(keypoints, "ankle")
    size = np.linalg.norm(forward, axis=-1) * np.linalg.norm(toes, axis=-1)
    cosine = np.sum(forward * toes, axis=-1) / np.maximum(size, 1e-12)
    # Feet that are stretched, as those of someone on the knees, point neither way.
    if np.mean(cosine) < _BACKWARDS:
        found = f"toes that point backwards on {100 * np.mean(cosine < 0):.0f} % of the frames"
        expected = "left and right where hips, shoulders and toes agree"
        hint = "; the motion is mirrored, or the skeleton names the sides the wrong way round"
        raise FileFormatError(path, "left and right", expected, found + hint)


def estimate_height(
    leg: float, rest: np.ndarray | None = None, head_top: np.ndarray | None = None
) -> float:
    """Standing height, m.

    Measured from ankle to crown on a rest skeleton that stands straight and has a joint at the top
    of the head, if that is within a tenth of what the legs say; else leg / 0.491.

    Args:
        leg: Leg length, m.
        rest: (15, 3) keypoints of a rest skeleton, m, z up, or None.
        head_top: (3,) top of the head of the same, or None.
    """
    by_leg = leg / LEG_PER_HEIGHT
    if rest is None or head_top is None:
        return by_leg
    ankles = _middle(rest, "ankle")
    measured = float(head_top[2] - ankles[2]) + ANKLE_HEIGHT + SCALP
    return measured if abs(measured - by_leg) < 0.1 * by_leg else by_leg


def _signed(axis: int, sign: float) -> UpAxis:
    return _AXES[axis] if sign > 0 else cast("UpAxis", f"-{_AXES[axis]}")


def _point(keypoints: np.ndarray, name: str) -> np.ndarray:
    return keypoints[..., KEYPOINTS.index(name), :]


def _middle(keypoints: np.ndarray, part: str) -> np.ndarray:
    left, right = (_point(keypoints, f"{side}_{part}") for side in SIDES)
    return 0.5 * (left + right)
