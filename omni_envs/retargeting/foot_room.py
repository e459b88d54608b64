"""Room for both feet: footholds on which the soles would overlap are moved apart.

A foothold is the middle of where a foot would be over a whole stance, so that two of them may
overlap though the feet never did, all the more as robots have wider feet than people. A foot that
lands on the other one hovers over it on its toes.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

_ROUNDS = 10
_ENOUGH = 1e-4  # m


def make_room(
    tips: np.ndarray,
    headings: np.ndarray,
    lengths: np.ndarray,
    width: float,
    pairs: Iterable[tuple[int, int]],
) -> np.ndarray:
    """Moves footholds apart, both of a pair by the same way, until their soles lie side by side.

    A sole is a stadium: all that is within half its width of a line from toe to heel.

    Args:
        tips: (N, 2) toe tips, m.
        headings: (N,) rad.
        lengths: (N,) of the soles, m.
        width: Of the soles, m.
        pairs: Numbers of footholds that are stood on at the same time.

    Returns:
        (N, 2) toe tips.
    """
    tips, forward = tips.copy(), np.stack([np.cos(headings), np.sin(headings)], axis=1)
    fore, aft = 0.5 * width * forward, (lengths[:, None] - 0.5 * width) * forward
    pairs = list(pairs)
    for _ in range(_ROUNDS):
        fits = True
        for i, j in pairs:
            way = _way(tips[i] - fore[i], tips[i] - aft[i], tips[j] - fore[j], tips[j] - aft[j])
            apart = float(np.linalg.norm(way))
            lack = width - apart
            if lack <= _ENOUGH:
                continue
            if apart < _ENOUGH:  # crossed: away from each other's middle
                way = (tips[j] - 0.5 * aft[j]) - (tips[i] - 0.5 * aft[i])
            push = 0.5 * lack * way / max(float(np.linalg.norm(way)), 1e-9)
            tips[i] -= push
            tips[j] += push
            fits = False
        if fits:
            break
    return tips


def _way(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(2,) shortest way from the line a-b to the line c-d, 0 where they cross."""
    along, across = b - a, d - c
    turn = _cross(along, across)
    if abs(turn) > 1e-12:
        s, t = _cross(c - a, across) / turn, _cross(c - a, along) / turn
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return np.zeros(2)
    ways = [_to_line(a, c, d), _to_line(b, c, d), -_to_line(c, a, b), -_to_line(d, a, b)]
    return min(ways, key=lambda way: float(way @ way))


def _cross(u: np.ndarray, v: np.ndarray) -> float:
    return float(u[0] * v[1] - u[1] * v[0])


def _to_line(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(2,) shortest way from a point to a line."""
    line = end - start
    part = np.clip((point - start) @ line / max(float(line @ line), 1e-12), 0.0, 1.0)
    return start + part * line - point
