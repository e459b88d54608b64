"""The tracking task on compiled loops: ``TrackingTask`` straight from the motion table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from omni_envs.envs.batches import Observation
from omni_envs.envs.episodes import Episodes
from omni_envs.envs.kinematics import body_tree
from omni_envs.envs.simulation import Simulation
from omni_envs.envs.task import TrackingTask
from omni_envs.tracking import kernels
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.randomization import start_widths

TESTS = ("anchor_height", "anchor_tilt", "end_effector_height", "object")

_PART = 32
"""Fewest simulations that are worth a thread: handing it over takes as long as eight of them."""


class Judged(NamedTuple):
    """What a control step was worth, for N simulations.

    Attributes:
        reward: (N,) sum of the terms.
        terminated: (N,) whether any flag is set.
        truncated: (N,) whether the episode is over for lack of motion or time alone.
        done: (N,) either.
        figures: (F, N) terms of the reward, then tracking errors: m, rad, m/s, rad/s.
        flags: (8, N) the tests in the order of ``TESTS``, whether the simulation diverged, and the
            three above.
        some_done: Whether any episode is over.
        push_due: Whether any simulation is to be pushed.
    """

    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    done: np.ndarray
    figures: np.ndarray
    flags: np.ndarray
    some_done: bool
    push_due: bool


class CompiledTask:
    """Rewards, terminations, observations and start states of N simulations in few passes.

    Attributes:
        numbers: What the loops know of the configuration.
        figures: Names of the rows of ``Judged.figures``, as in infos.
        flags: Names of rows of ``Judged.flags``, as in infos, without tests that are switched off.
        flag_rows: Their rows.
        noise_share: Share of the noise on the policy's observation; see ``NoiseGrowth``.
        draws: Numbers that a start state takes.

    Args:
        task: The task, names resolved.
        library: The motions.
        num: N.
        samples: Physics steps that a contact sensor remembers.
        threads: Threads that share the simulations. What comes out does not depend on them.
    """

    def __init__(
        self,
        task: TrackingTask,
        library: MotionLibrary,
        num: int,
        samples: int,
        threads: int = 1,
    ) -> None:
        parts = max(1, min(threads, num // _PART))
        self._first, *self._others = np.array_split(np.arange(num), parts)
        self._helpers = ThreadPoolExecutor(parts - 1) if self._others else None
        self.numbers = task.numbers(samples)
        plan = kernels.make_plan(self.numbers, library.at, body_tree(task.robot))
        self._plan = (*plan, library.table)
        self.figures = (*(f"reward/{n}" for n in task.terms), *(f"error/{n}" for n in task.errors))
        limits = task.config.termination
        configured = (
            limits.anchor_height is not None,
            limits.anchor_tilt is not None,
            limits.end_effector_height is not None,
            library.has_object,
        )
        self.flag_rows = [*(k for k, there in enumerate(configured) if there), len(TESTS)]
        self.flags = (*(f"terminated/{TESTS[k]}" for k in self.flag_rows[:-1]), "diverged")
        noise = task.config.reset.noise
        self._widths = np.empty((0, 0))
        if noise is not None:
            self._widths = start_widths(noise, len(task.soft_lower))[None]
        self.draws = self._widths.shape[1]
        self.noise_share = 1.0
        self._silence = np.empty((0, 0), np.float32)

    def settle(
        self,
        simulation: Simulation,
        episodes: Episodes,
        action: np.ndarray,
        diverged: np.ndarray,
        object_active: bool,
        rng: np.random.Generator,
        out: Observation,
    ) -> Judged:
        """Does what follows a control step of physics.

        Places the bodies, compares the states with the frames that the policy saw, moves on to the
        next frames and observes.

        Args:
            simulation: The states.
            episodes: Where the episodes are; they move on.
            action: (N, n).
            diverged: (N,) simulations that get no reward.
            object_active: Whether losing the object ends an episode.
            rng: Source of the observation's noise.
            out: Observations of N simulations, to write to.
        """
        num = simulation.num
        flags = np.empty((len(TESTS) + 4, num), bool)
        figures, reward = np.empty((len(self.figures), num)), np.empty(num)
        policy, critic = self._outputs(out)
        given = (
            *self._plan,
            episodes.table,
            simulation.qpos,
            simulation.qvel,
            *simulation.bodies(),
            episodes.default,
            action,
            episodes.action,
            simulation.history,
            object_active,
            diverged,
            seed_of(rng),
            self.noise_share,
        )
        written = figures, flags, reward, policy, critic
        some, due = self._shared(kernels.settle, given, written)
        episodes.action = action
        return Judged(reward, flags[5], flags[6], flags[7], figures, flags, some, due)

    def observe(
        self,
        simulation: Simulation,
        episodes: Episodes,
        ids: np.ndarray,
        rng: np.random.Generator,
        out: Observation,
    ) -> None:
        """Writes the observations of the simulations ``ids`` (K,) into their rows of ``out``.

        Their bodies are where they were last.
        """
        kernels.look(*self._seen(simulation, episodes, ids, rng, out))

    def begin(
        self,
        simulation: Simulation,
        episodes: Episodes,
        ids: np.ndarray,
        draws: np.ndarray,
        share: np.ndarray | None,
        rng: np.random.Generator,
        out: Observation,
    ) -> None:
        """Puts the simulations ``ids`` (K,) into start states, disturbed, and observes them.

        Args:
            simulation: The states, to write to.
            episodes: Where the episodes are, started already.
            ids: (K,) simulations.
            draws: (``self.draws``, K) uniform in [0, 1), of the disturbance.
            share: (K,) share of the disturbance that each gets, all of it by default.
            rng: Source of the observation's noise.
            out: Observations of N simulations, to write to.
        """
        widths = self._widths
        if share is not None and len(widths):
            widths = share[:, None] * widths
        seen = self._seen(simulation, episodes, ids, rng, out)
        kernels.begin(*seen, draws, widths)

    def _shared(
        self, loop: Callable[..., tuple[bool, bool]], given: Sequence[Any], written: Sequence[Any]
    ) -> tuple[bool, bool]:
        """Runs a loop over all simulations, each thread over its own; returns what holds of any."""
        if self._helpers is None:
            return loop(*given, self._first, *written)
        helped = [self._helpers.submit(loop, *given, ids, *written) for ids in self._others]
        found = [loop(*given, self._first, *written), *(help.result() for help in helped)]
        return any(some for some, _ in found), any(due for _, due in found)

    def _seen(
        self,
        simulation: Simulation,
        episodes: Episodes,
        ids: np.ndarray,
        rng: np.random.Generator,
        out: Observation,
    ) -> tuple[Any, ...]:
        """What the loops that observe take."""
        return (
            *self._plan,
            episodes.table,
            simulation.qpos,
            simulation.qvel,
            *simulation.bodies(),
            episodes.default,
            episodes.action,
            seed_of(rng),
            self.noise_share,
            ids,
            *self._outputs(out),
        )

    def _outputs(self, out: Observation) -> tuple[np.ndarray, np.ndarray]:
        """Where to write."""
        if isinstance(out, dict):
            return out["policy"], out["critic"]
        return out, self._silence


def seed_of(rng: np.random.Generator) -> int:
    """Draws the seed of a control step's noise, which the loops take further."""
    return int(rng.bit_generator.random_raw()) >> 1  # not negative as a signed number
