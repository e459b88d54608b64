"""The commands that repeat a run, typed again."""

import json
import shlex
from dataclasses import replace

import pytest
import tyro

from omni_envs.training.command import command_to_go_on, overlay
from omni_envs.training.config import merged
from omni_envs.training.recipes import RECIPES
from train import Arguments, make_config


@pytest.mark.parametrize("recipe", RECIPES)
def test_the_command_is_the_shortest_that_repeats_the_run(tmp_path, recipe):
    config = RECIPES[recipe].config("X", tmp_path, 7, seed=3)
    words = shlex.split(config.command())
    assert words[words.index("--recipe") + 1] == recipe
    assert "--ppo" not in words and "--num-envs" not in words
    assert words[words.index("--seed") + 1] == "3"
    changed = RECIPES[recipe].config("X", tmp_path, 7, num_envs=5)
    words = shlex.split(changed.command())
    assert words[words.index("--num-envs") + 1] == "5"
    assert "--ppo" not in words and words[words.index("--recipe") + 1] == recipe
    changed = RECIPES[recipe].config("X", tmp_path, 7, ppo={"gamma": 0.5}, device="auto")
    words = shlex.split(changed.command())
    assert json.loads(words[words.index("--ppo") + 1]) == {"gamma": 0.5}
    assert words[words.index("--device") + 1] == "auto" and "--env-options" not in words


@pytest.mark.parametrize("recipe", RECIPES)
@pytest.mark.parametrize(
    "changes",
    [
        {"num_envs": 3, "ppo": {"hidden": [8, 8], "clip": 0.3}},
        {"env_options": {"preset": "beyondmimic", "reset": {"start": "start"}}},
        {"training_options": {"observation": {"privileged": False}, "physics": "fast"}},
    ],
)
def test_the_command_repeats_a_changed_recipe(tmp_path, recipe, changes):
    config = RECIPES[recipe].config("X", tmp_path, 7, **changes)
    words = shlex.split(config.command())
    assert make_config(tyro.cli(Arguments, args=words[2:])) == config


def test_overlay_undoes_what_is_gone():
    old = {"a": {"x": 1, "y": 2}, "b": 3, "same": {"z": 0}}
    new = {"a": {"y": 5}, "c": 4, "same": {"z": 0}}
    changes = overlay(old, new)
    assert changes == {"a": {"x": None, "y": 5}, "b": None, "c": 4}
    assert merged(old, changes) == {"a": {"x": None, "y": 5}, "b": None, "same": {"z": 0}, "c": 4}


def test_going_on_names_what_changed_and_nothing_else(tmp_path):
    before = RECIPES["small"].config("X", tmp_path, 7, num_threads=2)
    assert _flags(command_to_go_on(before, replace(before, steps=9))) == {
        "resume", "env", "steps", "episodes", "out",
    }  # fmt: skip
    ppo = replace(before.ppo, epochs=before.ppo.epochs + 1)
    line = command_to_go_on(before, replace(before, num_threads=0, device="auto", ppo=ppo))
    assert _flags(line) == {
        "resume", "env", "steps", "episodes", "out", "num-threads", "device", "ppo",
    }  # fmt: skip
    words = shlex.split(line)
    assert json.loads(words[words.index("--ppo") + 1]) == {"epochs": ppo.epochs}


def _flags(line: str) -> set[str]:
    return {word[2:] for word in shlex.split(line) if word.startswith("--")}
