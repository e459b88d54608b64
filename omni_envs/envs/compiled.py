"""The tracking task on compiled loops: ``TrackingTask`` straight from the motion table."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omni_envs.envs.task import TrackingTask
from omni_envs.tracking import kernels
from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.motion import MotionLibrary
from omni_envs.tracking.randomization import start_widths, symmetric

TESTS = ("anchor_height", "anchor_tilt", "end_effector_height", "object")


class Judged(NamedTuple):
    """What a control step was worth, for N simulations.

    Attributes:
        reward: (N,) sum of the terms.
        terminated: (N,) whether any flag is set.
        figures: (F, N) terms of the reward, then tracking errors: m, rad, m/s, rad/s.
        flags: (5, N) the tests in the order of ``TESTS``, then whether the simulation diverged.
    """

    reward: np.ndarray
    terminated: np.ndarray
    figures: np.ndarray
    flags: np.ndarray


class CompiledTask:
    """Rewards, terminations, observations and start states of N simulations in few passes.

    Attributes:
        numbers: What the loops know of the configuration.
        figures: Names of the rows of ``Judged.figures``, as in infos.
        flags: Names of rows of ``Judged.flags``, as in infos, without tests that are switched off.
        flag_rows: Their rows.

    Args:
        task: The task, names resolved.
        library: The motions.
        samples: Physics steps that a contact sensor remembers.
    """

    def __init__(self, task: TrackingTask, library: MotionLibrary, samples: int) -> None:
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
        self._nothing = np.empty((0, 0))
        self._silence = np.empty((0, 0), np.float32)

    def judge(
        self,
        rows: np.ndarray,
        qpos: np.ndarray,
        bodies: Bodies,
        action: np.ndarray,
        previous_action: np.ndarray,
        history: np.ndarray,
        object_active: bool,
        diverged: np.ndarray,
    ) -> Judged:
        """Compares the states after a control step with the frames that the policy saw.

        Args:
            rows: (N,) frames as rows of the library's table.
            qpos: (N, nq).
            bodies: The robot's tracked bodies.
            action: (N, n).
            previous_action: (N, n).
            history: (N, nhistory) of the contact sensors.
            object_active: Whether losing the object ends an episode.
            diverged: (N,) simulations that get no reward.
        """
        num = len(rows)
        judged = Judged(
            np.empty(num),
            np.empty(num, bool),
            np.empty((len(self.figures), num)),
            np.empty((len(TESTS) + 1, num), bool),
        )
        kernels.judge(
            self.numbers,
            self._at,
            self._table,
            rows,
            qpos,
            bodies,
            action,
            previous_action,
            history,
            object_active,
            diverged,
            judged.figures,
            judged.flags,
            judged.reward,
            judged.terminated,
        )
        return judged

    def observe(
        self,
        rows: np.ndarray,
        qpos: np.ndarray,
        qvel: np.ndarray,
        bodies: Bodies,
        default: np.ndarray,
        action: np.ndarray,
        rng: np.random.Generator,
        ids: np.ndarray,
        out: np.ndarray | dict[str, np.ndarray],
    ) -> None:
        """Writes the observations of the simulations ``ids`` (K,) into their rows of ``out``.

        Args:
            rows: (N,) the frames to track next, as rows of the library's table.
            qpos: (N, nq).
            qvel: (N, nv).
            bodies: The robot's tracked bodies.
            default: (N, n) default joint positions.
            action: (N, n) previous action.
            rng: Source of the noise.
            ids: (K,) simulations.
            out: (N, size) float32, or ``{"policy": …, "critic": …}``.
        """
        noise = self._silence
        if self._noisy:
            noise = rng.random((len(ids), self._noisy), dtype=np.float32)
        policy, critic = (
            (out["policy"], out["critic"]) if isinstance(out, dict) else (out, self._silence)
        )
        kernels.observe(
            self.numbers,
            self._at,
            self._table,
            rows,
            qpos,
            qvel,
            bodies,
            default,
            action,
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
