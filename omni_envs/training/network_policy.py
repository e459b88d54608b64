"""A trained network in the place of a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import torch

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.training.checkpoint import FOLDER, Checkpoint, checkpoints
from omni_envs.training.network import Actor

Which = Literal["first", "last"]


class NetworkPolicy:
    """Acts with an actor, without exploration.

    Args:
        actor: Observation → action.
    """

    def __init__(self, actor: Actor) -> None:
        self.actor = actor.eval()

    def __call__(self, observations: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Returns the actions (N, n) for observations (N, ·).

        Raises:
            InvalidDataError: The observations have another length than those trained with.
        """
        size = self.actor.observation_size
        if observations.shape[1:] != (size,):
            raise InvalidDataError(
                "Policy", "observations", f"(N, {size})", f"{observations.shape}"
            )
        with torch.no_grad():
            return self.actor(torch.as_tensor(observations, dtype=torch.float32)).numpy()


def find_checkpoint(run: str | Path, which: Which = "last") -> Path:
    """Returns the newest checkpoint of a run, or the first: the untrained policy.

    Raises:
        FileFormatError: There is none.
    """
    found = checkpoints(Path(run))
    if not found:
        raise FileFormatError(Path(run) / FOLDER, "folder", "checkpoints of a run", "none")
    return found[-1 if which == "last" else 0]


def load_actor(checkpoint: Path) -> Actor:
    """Loads the actor of a checkpoint, averaged over its newest updates if the run does that.

    Raises:
        FileFormatError: The file is missing, damaged or holds another kind of network.
    """
    state = Checkpoint.load(checkpoint)
    try:
        return Actor.from_weights(state.acting).eval()
    except (KeyError, IndexError, RuntimeError) as error:
        raise FileFormatError(
            checkpoint, "policy", "the weights of a TrackingPolicy", repr(error)
        ) from error
