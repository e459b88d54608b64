"""Planted feet stay where the frame-by-frame pass has put them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.retargeting.kinematics import Kinematics, Points
from omni_envs.retargeting.limits import STANCE, RowLimit, Rows
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import ANCHORED, LOOSE
from omni_envs.robots import SIDES, Robot

TIP, HEART = 0, 1
"""Held points of a foot: the toe tip, and the heart of the sole, the mean of all other points."""

_SLID = 3.0  # tolerances: an anchored tip that left its window this far was forced to


def foot_points(robot: Robot) -> tuple[list[str], np.ndarray]:
    """Bodies and (4, 3) offsets of toe tip and heart of the left foot, then of the right."""
    bodies, offsets = [], []
    for side in SIDES:
        foot = robot.feet[side]
        sole = np.array(foot.sole)
        bodies += [foot.body] * 2
        offsets += [sole[-1], sole[:-1].mean(axis=0) if len(sole) > 1 else sole[-1]]
    return bodies, np.array(offsets)


@dataclass(frozen=True, eq=False)
class StanceWindows:
    """Where the feet of a whole clip may be.

    Attributes:
        axes: (T, 2, 2, 2) unit vectors along and across each foot, in which windows are measured.
        centre: (T, 2, 2, 2) of the window: foot; tip or heart; along and across, m.
        slack: (T, 2, 2, 2) half width of the window, infinite for none, m.
        slow: (T, 2) the tip moves at most ``step`` since the previous frame.
        step: Largest horizontal step of a slow tip, m, per axis.
    """

    axes: np.ndarray
    centre: np.ndarray
    slack: np.ndarray
    slow: np.ndarray
    step: float


def stance_windows(
    feet: np.ndarray, tiers: np.ndarray, fps: float, options: StanceOptions
) -> StanceWindows:
    """Windows that hold anchored feet in the places they have in a motion.

    The tip of an anchored foot stays in one place and its heart within the range it had: where the
    motion rolled the foot over its toes it may roll, where it did not it may not.

    Args:
        feet: (T, 2, 2, 2) horizontal places of tip and heart of both feet, m.
        tiers: (T, 2) tiers of ``stance_tiers``.
        fps: Frames per second.
        options: Settings.
    """
    frames = len(feet)
    axes = np.broadcast_to(np.eye(2), (frames, 2, 2, 2)).copy()
    centre, slack = np.zeros((frames, 2, 2, 2)), np.full((frames, 2, 2, 2), np.inf)
    for foot in range(2):
        edges = np.flatnonzero(np.diff(tiers[:, foot] == ANCHORED, prepend=False, append=False))
        for start, end in edges.reshape(-1, 2):
            run = slice(int(start), int(end))
            arm = (feet[run, foot, TIP] - feet[run, foot, HEART]).mean(axis=0)
            x, y = arm / max(float(np.hypot(*arm)), 1e-9)
            turned = np.array([[x, y], [-y, x]]) if np.hypot(x, y) > 0.5 else np.eye(2)
            places = feet[run, foot] @ turned.T
            low, high = places.min(axis=0), places.max(axis=0)
            half = 0.5 * (high - low)
            axes[run, foot], centre[run, foot] = turned, 0.5 * (low + high)
            # A tip that slid slides no further; half the tolerance is left to the restoration.
            slid = half[TIP] > _SLID * options.tolerance
            slack[run, foot, TIP] = np.where(slid, half[TIP], 0.5 * options.tolerance)
            slack[run, foot, HEART] = np.maximum(half[HEART], options.tolerance)
    planted = tiers >= LOOSE
    slow = np.zeros(tiers.shape, bool)
    slow[1:] = planted[1:] & planted[:-1] & ~((tiers[1:] == ANCHORED) & (tiers[:-1] == ANCHORED))
    step = options.loose_speed / fps / np.sqrt(2.0)  # half side of the square inside the circle
    return StanceWindows(axes, centre, slack, slow, float(step))


class KeptStance(RowLimit):
    """Windows of both feet on one frame of a clip.

    Args:
        windows: Windows of the clip.
        configuration: Kinematics of the robot.
    """

    def __init__(self, windows: StanceWindows, configuration: Kinematics) -> None:
        self._windows = windows
        self._points = Points(configuration.model, *foot_points(configuration.robot))
        self._t = 0
        self._previous: np.ndarray | None = None

    def set_frame(self, t: int, previous: np.ndarray | None) -> None:
        """Chooses frame t.

        Args:
            t: The frame.
            previous: (2, 2) horizontal tips on the frame before; None leaves slow tips free.
        """
        self._t, self._previous = t, previous

    def tips(self, configuration: Kinematics) -> np.ndarray:
        """(2, 2) horizontal toe tips."""
        return configuration.positions(self._points).reshape(2, 2, 3)[:, TIP, :2]

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns two rows for every held point."""
        t, windows = self._t, self._windows
        held = np.isfinite(windows.slack[t])
        slow = windows.slow[t] if self._previous is not None else np.zeros(2, bool)
        if not (held.any() or slow.any()):
            return None
        places = configuration.positions(self._points)
        jacobian = configuration.jacobians(self._points, places)[:2]
        places = places[:, :2].reshape(2, 2, 2)
        jacobian = np.moveaxis(jacobian, 0, 1).reshape(2, 2, 2, -1)
        axes = windows.axes[t][:, None]
        offset = (axes @ places[..., None])[..., 0] - windows.centre[t]
        A = [(axes @ jacobian)[held], jacobian[slow, TIP].reshape(-1, jacobian.shape[-1])]
        lower, upper = (
            [-windows.slack[t][held] - offset[held]],
            [windows.slack[t][held] - offset[held]],
        )
        if slow.any() and self._previous is not None:
            moved = (places[slow, TIP] - self._previous[slow]).ravel()
            lower.append(-windows.step - moved)
            upper.append(windows.step - moved)
        low = np.concatenate(lower)
        return Rows(np.concatenate(A), low, np.concatenate(upper), np.full(len(low), STANCE))
