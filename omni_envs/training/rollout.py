"""Plays one episode per simulation with any policy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium.vector import VectorEnv

from omni_envs.progress import ProgressCallback

BODY_ERROR, OBJECT_ERROR, FRAME = "error/body_position", "error/object_position", "frame"
"""Infos of the environment: distance of the tracked bodies from the re-aligned reference, root mean
square over the bodies (N,), m; distance of the object from its reference (N,), m; frame of the
motion that is tracked next (N,)."""


def tracking_errors(env: VectorEnv) -> dict[str, str]:
    """Returns the columns of a training's history that are infos: column to info.

    ``object_error_m`` is there where a reference of the environment has an object. The reward
    alone does not show whether an object is moved: one that is left where it stands costs little.
    """
    columns = {"body_error_m": BODY_ERROR}
    references = getattr(env.unwrapped, "references", ())
    if any(r.object_poses is not None for r in references):
        columns["object_error_m"] = OBJECT_ERROR
    return columns


class Policy(Protocol):
    """Observations (N, ·) at reference frames (N,) → actions (N, n)."""

    def __call__(self, observations: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Returns the actions."""
        ...


@dataclass(frozen=True, eq=False)
class Episodes:
    """One episode of each of N simulations.

    Attributes:
        lengths: (N,) control steps.
        returns: (N,) undiscounted sum of rewards.
        terminated: (N,) whether a termination criterion was hit.
        body_error: (N,) mean over the episode of the distance of the tracked bodies, m.
        object_error: (N,) largest distance of the object from its reference, m, or None without.
    """

    lengths: np.ndarray
    returns: np.ndarray
    terminated: np.ndarray
    body_error: np.ndarray
    object_error: np.ndarray | None = None


def play(
    env: VectorEnv,
    policy: Policy,
    *,
    seed: int | None = None,
    options: Mapping[str, Any] | None = None,
    max_steps: int | None = None,
    progress: ProgressCallback | None = None,
) -> Episodes:
    """Plays until every simulation has finished its first episode.

    Args:
        env: Vector environment in SAME_STEP mode with the infos of ``OmniVectorEnv``.
        policy: Who acts.
        seed: Seed of the reset.
        options: Options of the reset.
        max_steps: Control steps after which an episode counts as survived.
        progress: Called with the number of finished episodes and of all.
    """
    n = env.num_envs
    lengths, alive = np.zeros(n, int), np.ones(n, bool)
    returns, errors, terminated = np.zeros(n), np.zeros(n), np.zeros(n, bool)
    farthest, has_object = np.zeros(n), False
    observations, infos = env.reset(seed=seed, options=None if options is None else dict(options))
    while alive.any() and (max_steps is None or lengths.max() < max_steps):
        seen = observations["policy"] if isinstance(observations, Mapping) else observations
        actions = policy(seen, infos[FRAME])
        observations, rewards, ended, truncated, infos = env.step(actions)
        lengths[alive] += 1
        returns[alive] += rewards[alive]
        errors[alive] += infos[BODY_ERROR][alive]
        has_object = OBJECT_ERROR in infos
        if has_object:
            farthest[alive] = np.maximum(farthest, infos[OBJECT_ERROR])[alive]
        terminated |= alive & ended
        alive &= ~(ended | truncated)
        if progress is not None:
            progress(n - int(alive.sum()), n)
    objects = farthest if has_object else None
    return Episodes(lengths, returns, terminated, errors / lengths, objects)
