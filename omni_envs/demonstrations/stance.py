"""When a foot stands: three named definitions on the horizontal speed of the toe.

The horizontal (xy) speed is used on every ground, as OmniRetarget does: a foot that is lifted
straight up counts as standing until it moves sideways. Frame t is judged by the step from t − 1 to
t, so frame 0 never stands; what has to hold still is every pair of frames (t − 1, t) that both
stand.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from omni_envs.errors import InvalidDataError, UnknownNameError

StanceMode = Literal["text", "default", "code"]
"""``"text"``: the paper's 1 cm/s. ``"code"``: 30 cm/s, the 1 cm per frame of OmniRetarget's code
at 30 fps. ``"default"``: 10 cm/s to begin, 15 cm/s to end, at least 3 frames."""

STANCE_MODES: tuple[StanceMode, ...] = get_args(StanceMode)

_TEXT_SPEED, _CODE_SPEED = 0.01, 0.30
_BEGIN_SPEED, _END_SPEED, _MIN_FRAMES = 0.10, 0.15, 3

# A standing foot that turns further than this (rad) pivots; one that turns less in the rest (s)
# after has come to rest.
_PIVOT, _KEPT, _REST = np.deg2rad(15.0), np.deg2rad(5.0), 0.5


# A foot whose toes point further up than this (rad over the horizontal) lies on its heel.
_TOES_UP = np.deg2rad(40.0)


def lying_feet(directions: np.ndarray) -> np.ndarray:
    """Returns when a foot lies on its heel: its sole does not face the ground, so it cannot stand.

    Args:
        directions: (T, 3) vectors from toe to ankle.

    Returns:
        (T,) bool.
    """
    level = np.linalg.norm(directions[:, :2], axis=1)
    return np.arctan2(-directions[:, 2], level) > _TOES_UP


def toe_speeds(toe_positions: np.ndarray, fps: float) -> np.ndarray:
    """Horizontal speed (T,) of a toe path (T, 3), m/s; infinite on frame 0, which has no step."""
    steps = np.linalg.norm(np.diff(toe_positions[:, :2], axis=0), axis=1)
    return np.concatenate([[np.inf], steps * fps])


def stance_schedule(
    toe_positions: np.ndarray, fps: float, mode: StanceMode = "default"
) -> np.ndarray:
    """Returns when a foot stands.

    Args:
        toe_positions: (T, 3) path of the toe at robot scale, m.
        fps: Frames per second.
        mode: One of ``STANCE_MODES``.

    Returns:
        (T,) bool.

    Raises:
        UnknownNameError: The mode does not exist.
        InvalidDataError: The path is not (T, 3).
    """
    if mode not in STANCE_MODES:
        raise UnknownNameError("stance mode", mode, STANCE_MODES)
    if np.ndim(toe_positions) != 2 or np.shape(toe_positions)[1] != 3:
        shape = str(np.shape(toe_positions))
        raise InvalidDataError("stance_schedule", "toe_positions", "(T, 3)", shape)
    speed = toe_speeds(np.asarray(toe_positions, float), fps)
    if mode == "text":
        return speed <= _TEXT_SPEED
    if mode == "code":
        return speed <= _CODE_SPEED
    stance = np.zeros(len(speed), bool)
    standing = False
    for t, v in enumerate(speed):
        standing = bool(v <= (_END_SPEED if standing else _BEGIN_SPEED))
        stance[t] = standing
    return _drop_short(stance, _MIN_FRAMES)


def pivot_schedule(directions: np.ndarray, stance: np.ndarray, fps: float) -> np.ndarray:
    """Returns when a standing foot rolls or turns on its toes.

    The toe decides when a foot stands, so one stance may hold a flat foot, its roll onto the toes
    and a time on tiptoe. Here it falls into parts: the foot keeps its direction, within 15° of that
    at the start of the part; or it pivots on its toes, from where it leaves that direction until it
    has found another that it keeps for half a second.

    Args:
        directions: (T, 3) vectors from toe to ankle of the human.
        stance: (T,) bool.
        fps: Frames per second.

    Returns:
        (T,) bool: it stands, and pivots.
    """
    units = directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-9)
    pivots = np.zeros(len(stance), bool)
    ahead = max(1, round(_REST * fps))
    for start, stop in stance_intervals(stance):
        part = units[start:stop]
        begin = 0
        while begin < len(part):
            away = np.arccos(np.clip(part[begin:] @ part[begin], -1.0, 1.0))
            gone = np.flatnonzero(away > _PIVOT)
            if not len(gone):
                break
            left = begin + int(np.flatnonzero(away[: gone[0]] <= _KEPT)[-1]) + 1
            end = len(part)
            for t in range(begin + int(gone[0]) + 1, len(part) - ahead + 1):
                if (part[t : t + ahead] @ part[t]).min() >= np.cos(_KEPT):
                    end = t
                    break
            pivots[start + left : start + end] = True
            begin = end
    return pivots


def stance_intervals(stance: np.ndarray) -> list[tuple[int, int]]:
    """Runs of a (T,) bool schedule as half-open (start, stop) frames."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(stance, int), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _drop_short(stance: np.ndarray, frames: int) -> np.ndarray:
    for start, stop in stance_intervals(stance):
        if stop - start < frames:
            stance[start:stop] = False
    return stance
