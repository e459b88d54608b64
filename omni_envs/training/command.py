"""The command that repeats a run."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from typing import Any

from omni_envs.training.config import TrainConfig
from omni_envs.training.recipes import RECIPES

_GOING_ON = ("num_envs", "num_threads", "device")
_OF_A_RECIPE = ("num_envs", "env_options", "training_options", "ppo")


def command(config: TrainConfig) -> str:
    """Returns the command that repeats this run: a recipe, and what differs from it."""
    flags: dict[str, Any] = {
        "env": config.env,
        "trainer": config.trainer,
        "steps": config.steps,
        "time-limit": config.time_limit,
        "seed": config.seed,
        "device": config.device,
        "episodes": config.evaluation_episodes,
        "out": config.out,
    }
    if config.start_from:
        flags["start-from"] = config.start_from
    recipe, changes = _recipe(config)
    for name, value in changes.items():
        text = value if name == "num_envs" else json.dumps(value)
        flags[name.replace("_", "-")] = text
    words = [word for flag, value in flags.items() for word in (f"--{flag}", str(value))]
    return shlex.join(["python", "train.py", "--recipe", recipe, *words])


def command_to_go_on(before: TrainConfig, now: TrainConfig) -> str:
    """Returns the command that has a run go on with other settings: what differs."""
    old, new = before.to_dict(), now.to_dict()
    flags = {name.replace("_", "-"): new[name] for name in _GOING_ON if new[name] != old[name]}
    options = overlay(old["training_options"], new["training_options"])
    ppo = overlay(old["ppo"], new["ppo"])
    for name, changes in (("training-options", options), ("ppo", ppo)):
        if changes:
            flags[name] = json.dumps(changes)
    ends = {"env": now.env, "steps": now.steps, "episodes": now.evaluation_episodes, "out": now.out}
    words = [word for flag, v in (flags | ends).items() for word in (f"--{flag}", str(v))]
    return shlex.join(["python", "train.py", "--resume", *words])


def overlay(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """Returns what, laid over ``old`` by ``merged``, gives ``new``: what is gone becomes None."""
    changes: dict[str, Any] = {name: None for name in old if name not in new}
    for name, value in new.items():
        was = old.get(name)
        if isinstance(value, Mapping) and isinstance(was, Mapping):
            inner = {key: None for key in was if key not in value}
            inner |= {key: v for key, v in value.items() if key not in was or was[key] != v}
            if inner:
                changes[name] = inner
        elif name not in old or was != value:
            changes[name] = value
    return changes


def _recipe(config: TrainConfig) -> tuple[str, dict[str, Any]]:
    """Returns the recipe from which the fewest words lead here, and the changes to it."""
    data = config.to_dict()
    ways = []
    for name, recipe in RECIPES.items():
        base = recipe.config(config.env, config.out, config.steps).to_dict()
        changes = {key: data[key] for key in _OF_A_RECIPE if data[key] != base[key]}
        if "ppo" in changes:
            ppo = data["ppo"].items()
            changes["ppo"] = {k: value for k, value in ppo if value != base["ppo"][k]}
        again = recipe.config(config.env, config.out, config.steps, **changes).to_dict()
        # Options are laid over a recipe's: what it has and this run has not cannot be undone.
        exact = all(again[key] == data[key] for key in _OF_A_RECIPE)
        ways.append((not exact, len(json.dumps(changes)), name, changes))
    return min(ways, key=lambda way: way[:2])[2:]
