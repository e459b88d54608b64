"""A trained network in the place of a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import torch
from gymnasium import spaces

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
        """Returns the actions (N, n) for observations (N, ·)."""
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


def load_actor(checkpoint: Path, action_space: spaces.Box, observation_size: int) -> Actor:
    """Loads the actor of a checkpoint.

    Args:
        checkpoint: The file.
        action_space: Bounds of the actions.
        observation_size: Length of the observation that it must take.

    Raises:
        FileFormatError: The file is missing or damaged.
        InvalidDataError: The actor is for other observations or actions.
    """
    weights = Checkpoint.load(checkpoint).policy
    actor = Actor.from_weights(weights, action_space.low, action_space.high)
    sizes = (len(actor.normalizer.mean), actor.output.out_features)
    expected = (observation_size, *action_space.shape)
    if sizes != expected:
        raise InvalidDataError(
            str(checkpoint), "observation and action size", f"{expected}", f"{sizes}"
        )
    return actor
