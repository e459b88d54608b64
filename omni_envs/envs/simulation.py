"""N simulations of one model on ``mujoco.batch``: what the task reads and writes, as arrays."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from mujoco.batch import Batch

from omni_envs.envs.kinematics import BodyKinematics
from omni_envs.envs.model import EnvModel
from omni_envs.envs.variants import ModelVariants
from omni_envs.robots import Robot
from omni_envs.tracking import kernels
from omni_envs.tracking.alignment import Bodies

SPEED_LIMIT = 1e3
"""A generalized velocity beyond this (m/s, rad/s) is a numerical explosion, not a motion."""

_BAD_STATE = np.array(
    [
        int(mujoco.mjtWarning.mjWARN_BADQPOS),
        int(mujoco.mjtWarning.mjWARN_BADQVEL),
        int(mujoco.mjtWarning.mjWARN_BADQACC),
    ]
)
_NOTHING = int(mujoco.mjtStage.mjSTAGE_NONE)


class Simulation:
    """N simulations of a robot in its scene.

    Attributes:
        batch: MuJoCo's simulations.
        model: The model without randomization.
        num: N.
        substeps: Physics steps per control step.
        variant: (N,) indices of the randomized models in use.
        qpos: (N, nq) live: robot 7 + n, then the object's 7.
        qvel: (N, nv) live; angular parts of free joints in the body frame.
        ctrl: (N, n) live joint targets, rad.
        kinematics: The tracked bodies; see ``place_bodies``.
        exploded: Whether any simulation diverged in the last step.
        history: (N, nhistory) live, of the contact sensors; see ``EnvModel.contact_forces``.

    Args:
        env_model: The model.
        robot: The robot in it.
        variants: Randomized models that episodes draw from.
        num: N.
        substeps: Physics steps per control step.
        threads: Physics threads; 0 takes every core.
    """

    def __init__(
        self,
        env_model: EnvModel,
        robot: Robot,
        variants: ModelVariants,
        num: int,
        substeps: int,
        threads: int = 0,
    ) -> None:
        model = env_model.model
        self.model, self.num, self.substeps = model, num, substeps
        self._env_model = env_model
        self.batch = Batch(model, num, threads)
        self.qpos, self.qvel = self.batch.bind("qpos"), self.batch.bind("qvel")
        self.ctrl, self._warmstart = self.batch.bind("ctrl"), self.batch.bind("qacc_warmstart")
        self.history = self.batch.bind("history")
        self.kinematics = BodyKinematics(robot, num)
        self._variants, self._fields = variants, variants.attach(self.batch)
        self.variant = np.zeros(num, int)
        self._diverged, self._spoilt, self.exploded = np.zeros(num, bool), False, False
        self._before = (np.empty_like(self.qpos), np.empty_like(self.qvel), self.qvel.copy())
        self._live, self._pool = _varying(self._fields, variants.fields)
        self._use_variants(np.arange(num), self.variant)

    def step(self) -> np.ndarray:
        """Advances every simulation by a control step under ``ctrl``; the bodies come later.

        Returns:
            (N,) whether the simulation diverged. It is then back in the state before this step.
        """
        kernels.copy_states(self.qpos, self.qvel, self._warmstart, *self._before)
        self.batch.step(nstep=self.substeps)
        # MuJoCo resets a simulation that blew up without a word, and only counts a warning.
        diverged = np.empty(self.num, bool)
        self.exploded = kernels.exploded(
            self.qpos, self.qvel, self.batch.warning, _BAD_STATE, SPEED_LIMIT, diverged
        )
        if self.exploded:
            self.qpos[diverged], self.qvel[diverged] = (a[diverged] for a in self._before[:2])
            self._warmstart[diverged] = 0.0
            self._diverged |= diverged
            self._spoilt = True
        return diverged

    def reset(self, ids: np.ndarray, variant: np.ndarray) -> None:
        """Readies simulations to start anew: write their states next.

        Args:
            ids: (K,) sorted indices of the simulations.
            variant: (K,) indices of their randomized models.
        """
        # What a state consists of is written by us; MuJoCo's own reset, which costs more than all
        # of that, is for simulations that it has counted warnings of.
        if self._spoilt:
            spoilt = ids[self._diverged[ids]]
            if len(spoilt):
                self.batch.reset(spoilt, stage=_NOTHING)
                self._diverged[spoilt] = False
                self._spoilt = bool(self._diverged.any())
        self._use_variants(ids, variant)

    def place_bodies(self, ids: np.ndarray | None = None) -> None:
        """Computes the tracked bodies anew, of all simulations or of some."""
        self.kinematics.update(self.qpos, self.qvel, ids)

    def bodies(self, ids: np.ndarray | None = None) -> Bodies:
        """Returns the tracked bodies: live views of all simulations, or copies of some."""
        return self.kinematics.bodies(ids)

    def contact_forces(self) -> np.ndarray:
        """Returns the (N, sensors, samples, 3) contact forces of the last control step, N."""
        return self._env_model.contact_forces(self.history)

    def before(self, sim: int) -> dict[str, np.ndarray]:
        """Returns the state of one simulation before its last control step, for a replay."""
        names = ("qpos", "qvel", "qacc_warmstart")
        state = {k: a[sim].copy() for k, a in zip(names, self._before, strict=True)}
        return state | {"ctrl": self.ctrl[sim].copy(), "variant": np.array(self.variant[sim])}

    def model_of(self, sim: int) -> mujoco.MjModel:
        """Returns a copy of the model of one simulation, randomization included."""
        return self.batch.get_model(sim)

    def alone(self, variant: int) -> Batch:
        """Returns one further simulation, of a randomized model."""
        if self._variants.models:
            return Batch(self._variants.models[variant], 1, 1)
        batch = Batch(self.model, 1, 1)
        for name, values in self._variants.fields.items():
            batch.expand(name)[0] = values[variant]
        return batch

    @staticmethod
    def bad_states(batch: Batch) -> np.ndarray:
        """Returns (N,) how many warnings MuJoCo has counted of states that are not finite."""
        return batch.warning[:, _BAD_STATE, 1].sum(axis=1)

    def copy_models_to(self, other: Batch) -> None:
        """Gives another batch of N simulations the randomized models of these."""
        for name, live in self._fields.items():
            other.expand(name)[:] = live
        if self._variants.models:
            other.set_models([self._variants.models[v] for v in self.variant])

    def _use_variants(self, ids: np.ndarray, variant: np.ndarray) -> None:
        kernels.exchange_models(self._pool, variant, ids, self._live, self.variant, self._warmstart)
        if self._variants.models:
            self.batch.set_models([self._variants.models[v] for v in self.variant])


def _varying(
    live: Mapping[str, np.ndarray], values: Mapping[str, np.ndarray]
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Finds what an episode's model brings: of all fields the entries in which the models differ.

    Args:
        live: Field to (N, …) values of the simulations; entries in which the models agree are
            written here, once.
        values: Field to (M, …) values of the models.

    Returns:
        (N, …) views of the entries that differ, and their (M, S) values in all models.
    """
    count = max((len(v) for v in values.values()), default=1)
    parts, pools = [], [np.empty((count, 0))]
    for name, array in live.items():
        rows, known = _flat(array), values[name].reshape(len(values[name]), -1)
        rows[:] = known[0]
        differing = (known != known[0]).any(axis=0).nonzero()[0]
        if len(differing):
            between = slice(int(differing[0]), int(differing[-1]) + 1)
            parts.append(rows[:, between])
            pools.append(known[:, between].astype(float))  # exact for small integers, too
    # One part at least: a compiled loop takes no empty tuple.
    return tuple(parts) or (np.empty((1, 0)),), np.concatenate(pools, axis=1)


def _flat(values: np.ndarray) -> np.ndarray:
    """A view with one row per first index."""
    rows = values.reshape(len(values), -1)
    if not np.shares_memory(rows, values):
        raise RuntimeError("Model fields must be written without copies.")
    return rows
