"""Planted feet stay where the frame-by-frame pass has put them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.kinematics import Kinematics, Points
from omni_envs.retargeting.limits import FOOTING, STANCE, RowLimit, Rows
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import ANCHORED, LOOSE
from omni_envs.robots import SIDES, Robot

TIP, HEART = 0, 1
"""Held points of a foot: the toe tip, and the heart of the sole, the mean of all other points."""

_FLAT = 5e-3  # m: where the heart of an anchored sole moves less, the foot does not roll
_LANDING = 2e-3  # m: how far from its window a foot may land
_RISE = 0.03  # m/s that any planted tip may rise or sink
_TILT = 2e-3  # m that an anchored tip may rise when its foot tilts about its edge
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
        axes: (T, 2, 2, 3) unit vectors along and across each foot, in the surface under it, in
            which windows are measured.
        centre: (T, 2, 2, 2) of the window: foot; tip or heart; along and across, m.
        slack: (T, 2, 2, 2) half width of the window, infinite for none, m.
        steps: (T, 2, 3) largest step of the tip since the previous frame, m, along x, y and z;
            infinite for none.
        heights: (T, 2) height of the tips in the motion, m.
        ceiling: (T, 2) greatest height of the tips, infinite for none, m.
    """

    axes: np.ndarray
    centre: np.ndarray
    slack: np.ndarray
    steps: np.ndarray
    heights: np.ndarray
    ceiling: np.ndarray


def stance_windows(
    feet: np.ndarray, tiers: np.ndarray, human: HumanFeet, fps: float, options: StanceOptions
) -> StanceWindows:
    """Windows that hold anchored feet in the places they have in a motion.

    The tip of an anchored foot stays in one place and its heart within the range it had: where the
    motion rolled the foot over its toes it may roll, where it did not it may not. Planted tips that
    are not anchored are slow, and all planted tips rise no faster than they did, the anchored ones
    no higher: lifting a foot off a slope is slip.

    Args:
        feet: (T, 2, 2, 3) places of tip and heart of both feet, m.
        tiers: (T, 2) tiers of ``stance_tiers``.
        human: What the human's feet do while they are anchored.
        fps: Frames per second.
        options: Settings.
    """
    frames = len(feet)
    axes = human.axes.copy()
    centre, slack = np.zeros((frames, 2, 2, 2)), np.full((frames, 2, 2, 2), np.inf)
    for foot in range(2):
        edges = np.flatnonzero(np.diff(tiers[:, foot] == ANCHORED, prepend=False, append=False))
        for start, end in edges.reshape(-1, 2):
            run = slice(int(start), int(end))
            arm = axes[start, foot] @ (feet[run, foot, TIP] - feet[run, foot, HEART]).mean(axis=0)
            x, y = arm / max(float(np.hypot(*arm)), 1e-9)
            turned = np.array([[x, y], [-y, x]]) if np.hypot(x, y) > 0.5 else np.eye(2)
            turned = turned @ axes[start, foot]
            places = feet[run, foot] @ turned.T
            axes[run, foot] = turned
            centre[run, foot, TIP], slack[run, foot, TIP] = _tip_window(places[:, TIP], options)
            hearts, pivot = places[:, HEART], human.pivots[run, foot]
            cuts = np.zeros(0, int)
            arm = feet[run, foot, HEART] - feet[run, foot, TIP]
            if np.linalg.norm(arm - arm[0], axis=1).max() > _FLAT:
                cuts = np.flatnonzero(np.diff(pivot)) + 1
            for part in np.split(np.arange(len(pivot)), cuts):
                # Where the tip may be from where it was at the start of the part.
                room = centre[run, foot, TIP][0] - places[part[0], TIP]
                centre[start + part, foot, HEART], slack[start + part, foot, HEART] = _heart_window(
                    hearts[part], room, options, begins=part[0] == 0
                )
    planted, anchored = tiers >= LOOSE, tiers == ANCHORED
    planted, anchored = (flags[1:] & flags[:-1] for flags in (planted, anchored))
    slow = options.loose_speed / fps / np.sqrt(2.0)  # half side of the square inside the circle
    rise = np.maximum(np.abs(np.diff(feet[:, :, TIP, 2], axis=0)), _RISE / fps)
    steps = np.full((frames, 2, 3), np.inf)
    steps[1:, :, :2] = np.where(planted & ~anchored, slow, np.inf)[..., None]
    steps[1:, :, 2] = np.where(planted, rise, np.inf)
    heights, ceiling = feet[:, :, TIP, 2], np.full((frames, 2), np.inf)
    ceiling[1:][anchored] = heights[1:][anchored] + _TILT
    return StanceWindows(axes, centre, slack, steps, heights, ceiling)


def _tip_window(places: np.ndarray, options: StanceOptions) -> tuple[np.ndarray, np.ndarray]:
    """(F, 2) centres and half widths about the places of a tip."""
    low, high = places.min(axis=0), places.max(axis=0)
    if (high - low).max() > 2.0 * _SLID * options.tolerance:
        # It was forced to move: it moves where it moved, and holds still where it did.
        return places, np.full(places.shape, options.tolerance)
    centre = np.broadcast_to(0.5 * (low + high), places.shape)
    # Half the tolerance is left to the restoration.
    return centre, np.full(places.shape, 0.5 * options.tolerance)


def _heart_window(
    places: np.ndarray, room: np.ndarray, options: StanceOptions, begins: bool
) -> tuple[np.ndarray, np.ndarray]:
    """(F, 2) centres and half widths about the places of a heart: what it did since the start."""
    moved = places - places[0]
    low, high = moved.min(axis=0), moved.max(axis=0)
    corner = float(np.linalg.norm(np.maximum(-low, high)))
    if 0.0 < corner < _FLAT:
        # Nowhere in the window is further from the start than the heart was, tolerances included.
        part = max(np.linalg.norm(moved, axis=1).max() - 2.0 * options.tolerance, 0.0) / corner
        low, high = part * low, part * high
    # A flat foot whose tip is in its window must be in this one: it is as long as it is.
    low, high = np.minimum(low, room), np.maximum(high, room)
    half = np.repeat(np.maximum(0.5 * (high - low), options.tolerance)[None], len(places), axis=0)
    centre = np.repeat((places[0] + 0.5 * (low + high))[None], len(places), axis=0)
    if begins:
        centre[0], half[0] = places[0], options.tolerance
    return centre, half


class KeptStance(RowLimit):
    """Windows of both feet on one frame of a clip, for frames that are solved one after the other.

    Where a foot lands a little beside its window, which a limited speed may force it to, the
    windows of that stance move with it.

    Args:
        windows: Windows of the clip.
        configuration: Kinematics of the robot.
    """

    def __init__(self, windows: StanceWindows, configuration: Kinematics) -> None:
        self._windows = windows
        self._points = Points(configuration.model, *foot_points(configuration.robot))
        self._t, self._tips = 0, np.zeros((2, 3))
        self._landing, self._shift = np.zeros(2, bool), np.zeros((2, 2, 2))

    def hold(self, t: int) -> None:
        """Chooses frame t. ``record`` must have been called on frame t - 1."""
        anchored = np.isfinite(self._windows.slack[:, :, TIP, 0])
        self._t = t
        self._landing = anchored[t] & (~anchored[t - 1] if t > 0 else True)
        self._shift[self._landing] = 0.0

    def record(self, configuration: Kinematics) -> None:
        """Remembers where the frame has put the feet."""
        places = configuration.positions(self._points).reshape(2, 2, 3)
        offset, slack = self._offsets(places), self._windows.slack[self._t]
        beside = offset - np.clip(offset, -slack, slack)
        self._shift[self._landing] = np.clip(beside, -_LANDING, _LANDING)[self._landing]
        self._tips = places[:, TIP]

    def rows(self, configuration: Kinematics) -> Rows | None:
        """Returns rows for the windows and for the steps of slow tips."""
        t, windows = self._t, self._windows
        slow, low = np.isfinite(windows.steps[t]), np.isfinite(windows.ceiling[t])
        held = np.isfinite(windows.slack[t])
        if not (held.any() or slow.any() or low.any()):
            return None
        places = configuration.positions(self._points)
        jacobian = configuration.jacobians(self._points, places).transpose(1, 0, 2)
        places, jacobian = places.reshape(2, 2, 3), jacobian.reshape(2, 2, 3, -1)
        offset, slack = self._offsets(places)[held], windows.slack[t][held]
        moved, step = (places[:, TIP] - self._tips)[slow], windows.steps[t][slow]
        # A tip that a repair has lifted may always come back to the height it had: else every
        # repair of the next frames would lift it a little further.
        back = np.zeros((2, 3))
        back[:, 2] = np.minimum(windows.heights[t] - self._tips[:, 2], 0.0)
        turned = windows.axes[t][:, None] @ jacobian
        room = (windows.ceiling[t] - places[:, TIP, 2])[low]
        A = np.concatenate([turned[held], jacobian[:, TIP][slow], jacobian[low, TIP, 2]])
        least = np.minimum(-step, back[slow]) - moved
        lower = np.concatenate([-slack - offset, least, np.full(len(room), -np.inf)])
        upper = np.concatenate([slack - offset, step - moved, room])
        kind = np.full(len(lower), STANCE)
        landing = np.broadcast_to(self._landing[:, None, None], held.shape)[held]
        if landing.any():
            # A landing foot aims at its window, and must not miss it by more than a little.
            kind[: len(landing)][landing] = FOOTING
            wider = (slack + _LANDING)[landing]
            A = np.concatenate([A, turned[held][landing]])
            lower = np.append(lower, -wider - offset[landing])
            upper = np.append(upper, wider - offset[landing])
            kind = np.append(kind, np.full(len(wider), STANCE))
        # A free foot is not bound, but what repairs the frame shall know it: it will land.
        free = jacobian[~held.any(axis=(1, 2)), TIP].reshape(-1, jacobian.shape[-1])
        if len(free):
            A = np.concatenate([A, free])
            lower = np.append(lower, np.full(len(free), -np.inf))
            upper = np.append(upper, np.full(len(free), np.inf))
            kind = np.append(kind, np.full(len(free), FOOTING))
        return Rows(A, lower, upper, kind)

    def _offsets(self, places: np.ndarray) -> np.ndarray:
        """(2, 2, 2) offsets of (2, 2, 3) places from the centres of their windows."""
        axes, centre = self._windows.axes[self._t][:, None], self._windows.centre[self._t]
        return (axes @ places[..., None])[..., 0] - centre - self._shift
