"""Beginning with the networks of another run: fine-tuning."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from omni_envs.errors import InvalidOptionError
from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.network_policy import find_checkpoint
from omni_envs.training.stretches import explore_with


def with_networks_of(run: str | Path, state: Checkpoint, initial_std: float) -> Checkpoint:
    """Returns the state of a new run with the networks of another one.

    Actor, critic and observation statistics are taken over, the actor as it is evaluated: averaged
    where the run averages, and so is how they were trained. The optimiser, the steps and what the
    environment has learnt are new.

    Args:
        run: Run directory or published policy, of either trainer.
        state: The new run before its first update.
        initial_std: Exploration noise to begin with, the geometric mean over the joints.

    Raises:
        FileFormatError: There is no checkpoint, or it is damaged.
        InvalidOptionError: Its networks have other shapes than those of the new run.
    """
    other = Checkpoint.load(find_checkpoint(run))
    policy = {k: v.clone() for k, v in other.acting.items()}
    shapes = [{k: tuple(v.shape) for k, v in p.items()} for p in (policy, state.policy)]
    if shapes[0] != shapes[1]:
        differ = sorted(k for k in shapes[0] | shapes[1] if shapes[0].get(k) != shapes[1].get(k))
        raise InvalidOptionError(
            f"start_from: the networks of {run} have other shapes than those of this run: "
            f"{', '.join(differ)}. Robot, observation and ppo.hidden must be the same."
        )
    explore_with(policy, initial_std)
    return replace(state, policy=policy, ancestors=other.lineage)
