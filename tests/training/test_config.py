import dataclasses
import json
import shlex
from pathlib import Path

import pytest
import tyro

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.training.config import PPOConfig, TrainConfig, merged
from omni_envs.training.recipes import RECIPES


def _config(tmp_path: Path) -> TrainConfig:
    return TrainConfig(
        env="OmniEnvs/G1BoxCarry-v0",
        out=tmp_path / "run",
        steps=1000,
        env_options={"action": {"mode": "residual"}},
        ppo=PPOConfig(hidden=(64, 32), value_clip=0.0),
    )


def test_defaults_are_the_published_ones():
    assert dataclasses.asdict(PPOConfig()) == {
        "rollout_steps": 24,
        "epochs": 5,
        "minibatches": 4,
        "learning_rate": 1e-3,
        "critic_learning_rate": 0.0,
        "desired_kl": 0.01,
        "adapt_every": "minibatch",
        "gamma": 0.99,
        "gae_lambda": 0.95,
        "clip": 0.2,
        "value_clip": 0.2,
        "value_weight": 1.0,
        "entropy_weight": 0.005,
        "max_grad_norm": 1.0,
        "hidden": (512, 256, 128),
        "initial_std": 1.0,
    }


def test_round_trip_through_the_run_directory(tmp_path):
    config = _config(tmp_path)
    config.save()
    assert TrainConfig.load(config.out) == config


def test_a_run_directory_may_be_moved(tmp_path):
    config = _config(tmp_path)
    config.save()
    moved = config.out.rename(tmp_path / "elsewhere")
    assert TrainConfig.load(moved).out == moved


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"device": "tpu"}, "device must be 'auto', 'cpu' or 'cuda'; got 'tpu'"),
        ({"stesp": 3}, r"unknown \['stesp'\]. Valid: .*steps"),
        ({"ppo": {"gama": 0.9}}, r"TrainConfig.ppo: unknown \['gama'\]"),
        ({"steps": 0}, "steps must be positive; got 0"),
        ({"trainer": "rllib"}, "trainer must be 'sb3' or 'torchrl'; got 'rllib'"),
        ({"ppo": {"hidden": []}}, "hidden must be widths"),
        ({"ppo": {"adapt_every": "epoch"}}, "adapt_every must be 'minibatch' or 'update'"),
        ({"ppo": {"hidden": 5}}, "hidden must be widths"),
        ({"ppo": {"hidden": [8.5]}}, "hidden must be widths"),
        ({"ppo": {"epochs": -1}}, "epochs must be a whole number from 1 on; got -1"),
        ({"ppo": {"minibatches": 2.5}}, "minibatches must be a whole number from 1 on; got 2.5"),
        ({"ppo": {"gamma": 1.5}}, "gamma must be from 0 to 1; got 1.5"),
        ({"ppo": {"gae_lambda": -0.1}}, "gae_lambda must be from 0 to 1"),
        ({"ppo": {"clip": 0}}, "clip must be positive; got 0"),
        ({"ppo": {"learning_rate": "fast"}}, "learning_rate must be positive; got 'fast'"),
        ({"ppo": {"value_clip": -1}}, "value_clip must be 0 or more"),
        ({"ppo": {"desired_kl": float("nan")}}, "desired_kl must be 0 or more; got nan"),
        ({"seed": -1}, "seed must be 0 or more; got -1"),
        ({"time_limit": -5}, "time_limit must be 0 or more"),
    ],
)
def test_bad_values_are_one_clear_error(tmp_path, change, message):
    data = {**_config(tmp_path).to_dict(), **change}
    with pytest.raises(InvalidOptionError, match=message):
        TrainConfig.from_dict(data)


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
    from train import Arguments, make_config

    config = RECIPES[recipe].config("X", tmp_path, 7, **changes)
    words = shlex.split(config.command())
    assert make_config(tyro.cli(Arguments, args=words[2:])) == config


def test_options_are_merged_field_by_field(tmp_path):
    task = {"action": {"mode": "residual"}, "physics": "default", "reset": {"start": "start"}}
    changes = {"action": {"scale": 2.0}, "physics": "fast", "reset": {"noise": None}}
    assert merged(task, changes) == {
        "action": {"mode": "residual", "scale": 2.0},
        "physics": "fast",
        "reset": {"start": "start", "noise": None},
    }
    assert task["action"] == {"mode": "residual"}


def test_options_that_are_not_json_are_refused(tmp_path):
    for name in ("env_options", "training_options"):
        with pytest.raises(InvalidOptionError, match=f"{name} must be a JSON-compatible mapping"):
            dataclasses.replace(_config(tmp_path), **{name: {"reference": object()}})


def test_missing_or_damaged_files_are_one_clear_error(tmp_path):
    with pytest.raises(FileFormatError, match="nothing"):
        TrainConfig.load(tmp_path)
    for text in ("{", "[]", json.dumps({"env": "x"})):
        (tmp_path / "config.json").write_text(text)
        with pytest.raises(FileFormatError, match=r"config\.json: content"):
            TrainConfig.load(tmp_path)
