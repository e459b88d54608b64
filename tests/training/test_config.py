import dataclasses
import json
from pathlib import Path

import pytest

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.training.config import PPOConfig, TrainConfig, merged


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
        "action_weight": 0.0,
        "max_grad_norm": 1.0,
        "hidden": (512, 256, 128),
        "initial_std": 1.0,
        "average_updates": 0,
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
