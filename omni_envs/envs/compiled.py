"""The tracking task on compiled loops: ``TrackingTask`` straight from the motion table."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omni_envs.envs.batches import Observation
from omni_envs.envs.episodes import Episodes
from omni_envs.envs.simulation import Simulation
from omni_envs.envs.task import TrackingTask
from omni_envs.tracking import kernels
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.randomization import start_widths, symmetric

TESTS = ("anchor_height", "anchor_tilt", "end_effector_height", "object")


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

    Args:
        task: The task, names resolved.
        library: The motions.
        num: N.
        samples: Physics steps that a contact sensor remembers.
    """

    def __init__(self, task: TrackingTask, library: MotionLibrary, num: int, samples: int) -> None:
        self._everyone = np.arange(num)
        self.numbers = task.numbers(samples)
        self._table, self._at = library.table, library.at
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
        joints = len(task.soft_lower)
        self._widths = None if noise is None else start_widths(noise, joints)
        self._noisy = len(self.numbers.noise_width)
        self.noise_share = 1.0
        self._nothing = np.empty((0, 0))
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
        terminated, truncated, done = flags[-3:]
        noise, policy, critic = self._outputs(num, rng, out)
        some, due = kernels.settle(
            self.numbers,
            self._at,
            self._table,
            simulation.kinematics.tree,
            episodes.clocks,
            simulation.qpos,
            simulation.qvel,
            episodes.default,
            action,
            episodes.action,
            simulation.history,
            object_active,
            diverged,
            noise,
            self._everyone,
            simulation.bodies(),
            figures,
            flags,
            reward,
            terminated,
            truncated,
            done,
            policy,
            critic,
        )
        episodes.action = action
        return Judged(reward, terminated, truncated, done, figures, flags, some, due)

    def observe(
        self,
        simulation: Simulation,
        episodes: Episodes,
        ids: np.ndarray,
        rng: np.random.Generator,
        out: Observation,
    ) -> None:
        """Writes the observations of the simulations ``ids`` (K,) into their rows of ``out``."""
        noise, policy, critic = self._outputs(len(ids), rng, out)
        kernels.observe(
            self.numbers,
            self._at,
            self._table,
            episodes.rows,
            simulation.qpos,
            simulation.qvel,
            simulation.bodies(),
            episodes.default,
            episodes.action,
            noise,
            ids,
            policy,
            critic,
        )

    def start(
        self,
        rows: np.ndarray,
        rng: np.random.Generator,
        ids: np.ndarray,
        qpos: np.ndarray,
        qvel: np.ndarray,
        share: np.ndarray | None = None,
    ) -> None:
        """Writes start states into the rows ``ids`` (K,) of (N, nq) and (N, nv), disturbed.

        Args:
            rows: (K,) frames to start in, as rows of the library's table.
            rng: Source of the disturbance.
            ids: (K,) simulations.
            qpos: (N, nq) to write to.
            qvel: (N, nv) to write to.
            share: (K,) share of the disturbance that each gets, all of it by default.
        """
        draws = self._nothing if self._widths is None else symmetric(rng, len(ids), self._widths)
        if share is not None and len(draws):
            draws *= share[:, None]
        kernels.start_states(self.numbers, self._at, self._table, rows, draws, ids, qpos, qvel)

    def _outputs(
        self, count: int, rng: np.random.Generator, out: Observation
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Noise of (count, W) numbers in [0, 1), and where to write."""
        noise = self._silence
        if self._noisy:
            noise = rng.random((count, self._noisy), dtype=np.float32)
            if self.noise_share < 1.0:
                noise -= 0.5
                noise *= self.noise_share
                noise += 0.5
        if isinstance(out, dict):
            return noise, out["policy"], out["critic"]
        return noise, out, self._silence
