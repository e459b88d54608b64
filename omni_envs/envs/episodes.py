"""The running episodes of N simulations: where each is in its motion, and how it ends."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from omni_envs.tracking import kernels
from omni_envs.tracking.config import NoiseGrowth, TrackingConfig
from omni_envs.tracking.motion import MotionLibrary

GATE_EPISODES = 100
"""Finished episodes over which body tracking is judged."""


class ObjectGate:
    """Opens the object termination once the body is tracked reasonably.

    OmniRetarget tests the object only "after" that. Here reasonable means: over the last
    ``GATE_EPISODES`` finished episodes, the mean share that episodes lasted of what they could have
    is at least ``share``. Once open it stays open.

    Args:
        share: In [0, 1]; 0 is open from the start.
    """

    def __init__(self, share: float) -> None:
        self._share = share
        self.reset()

    def reset(self) -> None:
        """Forgets all episodes."""
        self._recent: deque[float] = deque(maxlen=GATE_EPISODES)
        self.open = self._share <= 0

    def record(self, lasted: np.ndarray, possible: np.ndarray) -> None:
        """Counts finished episodes: (K,) control steps they lasted and could have lasted."""
        if self.open:
            return
        shares = zip(lasted.tolist(), possible.tolist(), strict=True)
        self._recent.extend([a / b for a, b in shares])
        full = len(self._recent) == GATE_EPISODES
        self.open = full and sum(self._recent) >= self._share * GATE_EPISODES

    def state(self) -> dict[str, Any]:
        """Returns what ``restore`` takes, JSON-compatible."""
        return {"open": self.open, "recent": list(self._recent)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from what ``state`` returned."""
        self.reset()
        self.open = self.open or bool(state["open"])
        self._recent.extend(state["recent"])


class NoiseLevel:
    """How much of the start noise episodes get; see ``NoiseGrowth``.

    Args:
        config: How it grows, or None: all of it, always.
    """

    def __init__(self, config: NoiseGrowth | None) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forgets all episodes."""
        self.level = 1.0 if self._config is None else 0.0
        self._episodes, self._lasted, self._possible = 0, 0, 0

    def record(self, lasted: np.ndarray, possible: np.ndarray) -> None:
        """Counts finished episodes: (K,) control steps they lasted and could have lasted."""
        if self._config is None:
            return
        self._episodes += len(lasted)
        self._lasted += int(lasted.sum())
        self._possible += int(possible.sum())
        if self._episodes >= GATE_EPISODES:
            good = self._lasted >= self._config.share * self._possible
            level = self.level + (self._config.step if good else -self._config.step)
            self.level = min(max(level, 0.0), 1.0)
            self._episodes, self._lasted, self._possible = 0, 0, 0

    def state(self) -> dict[str, Any]:
        """Returns what ``restore`` takes, JSON-compatible."""
        counts = {"episodes": self._episodes, "lasted": self._lasted, "possible": self._possible}
        return {"level": self.level, **counts}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Goes on from what ``state`` returned; noise that does not grow stays whole."""
        self.reset()
        if self._config is not None:
            self.level = float(state["level"])
            names = ("episodes", "lasted", "possible")
            self._episodes, self._lasted, self._possible = (int(state[n]) for n in names)

    @property
    def observed(self) -> float:
        """Share of the noise on the policy's observation."""
        growing = self._config is not None and self._config.observation
        return self.level if growing else 1.0

    def shares(self, draws: np.ndarray) -> np.ndarray | None:
        """Returns (K,) shares of the noise, from (K,) draws in [0, 1), or None: all of it."""
        return None if self._config is None else self.level * np.sqrt(draws)


class Episodes:
    """One running episode per simulation.

    Attributes:
        motion: (N,) motion that is tracked.
        frame: (N,) frame of it that is to be tracked next.
        elapsed: (N,) control steps since the start.
        possible: (N,) control steps from the start to the end of motion or time.
        action: (N, n) previous action.
        default: (N, n) default joint positions, randomization included, rad.
        rows: (N,) row of the library's table to track next.
        table: (7, N) all of these and the next pushes, which the kernels move on.
        clocks: Its rows by name.
        draws: Numbers that the start of an episode takes.

    Args:
        library: The motions.
        default: (n,) default joint positions, rad.
        num: N.
        config: The task.
        max_steps: Control steps until the time-out, or None.
    """

    def __init__(
        self,
        library: MotionLibrary,
        default: np.ndarray,
        num: int,
        config: TrackingConfig,
        max_steps: int | None,
    ) -> None:
        self._library, self._nominal = library, default
        self._half = config.randomization.joint_default
        self._most = kernels.NEVER if max_steps is None else max_steps
        push = config.randomization.push
        between = () if push is None else push.interval
        self._between = np.array(between, float) / config.physics.control_step
        joints = len(default)
        self.draws = 1 + joints
        self.action, self.default = np.zeros((num, joints)), np.tile(default, (num, 1))
        self.motion = np.zeros(num, int)
        self.table = np.zeros((len(kernels.Clocks._fields), num), int)
        self.clocks = kernels.Clocks(*self.table)
        self.rows, self.frame = self.clocks.rows, self.clocks.frame
        self.elapsed, self.possible = self.clocks.elapsed, self.clocks.possible

    def start(
        self, ids: np.ndarray, motion: np.ndarray, frame: np.ndarray, draws: np.ndarray
    ) -> None:
        """Starts episodes in frames of motions; the frames after them are to be tracked next.

        Args:
            ids: (K,) simulations.
            motion: (K,) motions.
            frame: (K,) frames that the simulations are put in.
            draws: (``self.draws``, K) uniform in [0, 1).
        """
        kernels.start_clocks(
            self.table,
            self._library.starts,
            self._library.lengths,
            motion,
            frame,
            self._most,
            self._between,
            self._nominal,
            self._half,
            draws,
            ids,
            self.motion,
            self.default,
            self.action,
        )

    def due_pushes(self, rng: np.random.Generator) -> np.ndarray:
        """Returns the simulations (K,) to push now, and draws when they are to be pushed next."""
        due = (self.clocks.next_push <= 0).nonzero()[0]
        for i, draw in zip(due, rng.random(len(due)), strict=True):
            self.clocks.next_push[i] = kernels.next_push(self._between, draw)
        return due
