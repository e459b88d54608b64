"""Leading a smoothed motion around what it was moved into."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.interior_point import solve_clip_qp
from omni_envs.retargeting.tangents import difference, moved

# A smoothed motion that penetrates deeper (m) than the motion before is led around: it goes back to
# that on the frames about, and more frames about are solved again, in boxes this wide, and narrower
# where it penetrated.
_DEEP = 2e-3
_BLEND, _SPAN = 8, 40
_ATTEMPTS, _SHORT, _NARROW, _STILL = 2, (0.1, 0.1, 0.05, 0.02), 0.3, 1e-4


def led_around(
    program: ClipProgram, before: np.ndarray, qpos: np.ndarray, tolerance: float
) -> np.ndarray:
    """Leads a motion around what it was moved into.

    A limb that jumps from one side of something to the other in ``before`` may be smoothed right
    through it, and from inside a program finds no way out. There the motion goes back to ``before``
    and starts again with steps too short to get in.

    Args:
        program: The program of the clip.
        before: (T, nq) the motion before smoothing.
        qpos: (T, nq) the smoothed motion.
        tolerance: See ``RefineOptions``.
    """
    frames = len(qpos)
    depths = program.depths(qpos, 0, frames)
    if depths.max(initial=0.0) <= _DEEP:
        return qpos
    allowed = np.maximum(program.depths(before, 0, frames), _DEEP)
    for attempt in range(_ATTEMPTS + 1):
        deep = np.flatnonzero(depths > allowed)
        if not len(deep):
            break
        if attempt == _ATTEMPTS:
            return led_back(before, qpos, deep)
        qpos = smoothed_again(program, before, qpos, tolerance, deep)
        depths = program.depths(qpos, 0, frames)
    return qpos


def led_back(before: np.ndarray, qpos: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """(T, nq) a smoothed motion, led back to the one before on (N,) ascending frames and about."""
    share = _share(len(qpos), frames)
    return moved(before, share[:, None] * difference(before, qpos))


def smoothed_again(
    program: ClipProgram, before: np.ndarray, qpos: np.ndarray, tolerance: float, frames: np.ndarray
) -> np.ndarray:
    """(T, nq) a smoothed motion led back on (N,) ascending frames, and smoothed with short steps.

    See ``led_around``.
    """
    share, qpos = _share(len(qpos), frames), led_back(before, qpos, frames)
    for start, stop in _around(frames, len(qpos)):
        for radius in _SHORT:
            boxes = radius * np.maximum(share[start:stop], _NARROW)
            # Limits on the steps from and to the frames beyond are not in the program.
            if start > 0:
                boxes[0] = _STILL
            if stop < len(qpos):
                boxes[-1] = _STILL
            solution = solve_clip_qp(program.linearise(qpos, start, stop, boxes), tolerance)
            qpos[start:stop] = moved(qpos[start:stop], solution.x)
    return qpos


def _share(count: int, frames: np.ndarray) -> np.ndarray:
    """(T,) how much of the smoothing stays: 0 on (N,) ascending frames, 1 far from them."""
    if not len(frames):
        return np.ones(count)
    at = np.arange(count)
    after = np.searchsorted(frames, at)
    nearest = frames[np.clip([after - 1, after], 0, len(frames) - 1)]
    far = np.abs(at - nearest).min(axis=0)
    back = np.clip((far - 1.0) / _BLEND, 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(np.pi * back)


def _around(deep: np.ndarray, frames: int) -> Iterator[tuple[int, int]]:
    """Start and stop of the frames that are solved again about (N,) frames in ascending order."""
    for group in np.split(deep, np.flatnonzero(np.diff(deep) > 2 * _SPAN) + 1):
        yield max(0, int(group[0]) - _SPAN), min(frames, int(group[-1]) + _SPAN + 1)
