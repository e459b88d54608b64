"""The stretches of a run: from which step on it was trained where, and with which settings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from omni_envs.errors import InvalidOptionError
from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import TrainConfig

if TYPE_CHECKING:
    from torch import Tensor

Stretch = dict[str, Any]
"""``from``: control steps at its begin; ``machine``: see ``device.machine``; ``config``: settings
(``TrainConfig.to_dict``)."""

_FIXED = ("env", "trainer", "seed", "env_options", "start_from")
_FIXED_PPO = ("hidden",)
# What does not change what is learnt.
_ASIDE = ("out", "steps", "time_limit", "checkpoint_every", "evaluation_episodes")


def lengthened(
    stretches: Sequence[Stretch], config: TrainConfig, steps: int, machine: str
) -> list[Stretch]:
    """Returns the stretches of a run that goes on: one more where settings or machine changed.

    Args:
        stretches: Those so far.
        config: Settings from now on.
        steps: Control steps so far.
        machine: What trains from now on, in words.
    """
    now: Stretch = {"from": steps, "machine": machine, "config": config.to_dict()}
    if stretches and _what(stretches[-1]) == _what(now):
        return list(stretches)
    # Nothing was learnt in a stretch that began here, too.
    return [*(s for s in stretches if s["from"] < steps), now]


def check_changes(before: TrainConfig, after: TrainConfig) -> None:
    """Refuses settings that a run cannot go on with.

    Raises:
        InvalidOptionError: The task, the trainer, the seed or the shape of the networks changed.
    """
    old, new = before.to_dict(), after.to_dict()
    pairs = [(name, old[name], new[name]) for name in _FIXED]
    pairs += [(f"ppo.{name}", old["ppo"][name], new["ppo"][name]) for name in _FIXED_PPO]
    for name, was, now in pairs:
        if was != now:
            raise InvalidOptionError(
                f"{after.out}: {name} of a run that goes on must stay {was!r}; got {now!r}."
            )
    one, other = (bool(c.ppo.critic_learning_rate) for c in (before, after))
    if one != other:
        raise InvalidOptionError(
            f"{after.out}: ppo.critic_learning_rate of a run that goes on must stay "
            f"{'a rate of its own' if one else '0, the rate of the actor'}."
        )


def explore_with(policy: Mapping[str, Tensor], std: float) -> None:
    """Moves the exploration noise of a policy in place.

    The joints keep their ratios; the geometric mean becomes what was asked for.

    Args:
        policy: Weights (``Checkpoint.policy``).
        std: Standard deviation of the actions.
    """
    log_std = policy["log_std"]
    log_std += math.log(std) - log_std.mean()


def set_exploration(state: Checkpoint, config: TrainConfig) -> None:
    """Moves the exploration noise of a policy to another ``initial_std``, if that is asked for.

    Args:
        state: The run so far; its policy is changed in place.
        config: Settings from now on.
    """
    wanted = config.ppo.initial_std
    if state.stretches and state.stretches[-1]["config"]["ppo"]["initial_std"] != wanted:
        explore_with(state.policy, wanted)


def commands(
    config: TrainConfig, stretches: Sequence[Stretch], ancestors: Sequence[Mapping[str, Any]] = ()
) -> list[str]:
    """Returns the commands that repeat a run, one per stretch.

    Args:
        config: The run as it ended, with the steps that it got.
        stretches: Its stretches; without any the run is one.
        ancestors: The runs that it began with (``Checkpoint.ancestors``), which come first; their
            directories are numbered ones beside its own.
    """
    lines: list[str] = []
    for number, parent in enumerate(ancestors, 1):
        if not parent["stretches"]:  # of a version that did not write them down
            continue
        out = config.out.with_name(f"{config.out.name}_{number}")
        last = TrainConfig.from_dict(parent["stretches"][-1]["config"])
        before = f"{config.out}_{number - 1}" if lines else last.start_from
        run = replace(config, out=out, steps=parent["steps"], start_from=before)
        lines += commands(run, parent["stretches"])
        config = replace(config, start_from=str(out))
    if not stretches:
        return [*lines, config.command()]
    ends = [*(s["from"] for s in stretches[1:]), config.steps]
    settings = [
        replace(
            TrainConfig.from_dict(s["config"]),
            out=config.out,
            steps=end,
            time_limit=0.0,
            evaluation_episodes=config.evaluation_episodes,
            start_from=config.start_from,
        )
        for s, end in zip(stretches, ends, strict=True)
    ]
    first, *rest = settings
    later = [now.command(before) for before, now in zip(settings, rest, strict=False)]
    return [*lines, first.command(), *later]


def machines(stretches: Sequence[Stretch]) -> list[str]:
    """Returns what a run was trained on, in words, each once, in the order of use."""
    return list(dict.fromkeys(s["machine"] for s in stretches))


def _what(stretch: Stretch) -> Any:
    settings = {k: v for k, v in stretch["config"].items() if k not in _ASIDE}
    return stretch["machine"], settings
