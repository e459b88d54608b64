"""A run that begins with the networks of another one."""

import itertools
from dataclasses import replace

import pytest

pytest.importorskip("torch")
import torch

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.training.checkpoint import Checkpoint, checkpoints
from omni_envs.training.config import PPOConfig, TrainConfig
from omni_envs.training.learner import autoreset_mode
from omni_envs.training.run import train

PACKAGES = {"sb3": "stable_baselines3", "torchrl": "torchrl"}
PPO = PPOConfig(rollout_steps=8, epochs=2, minibatches=2, hidden=(16,), average_updates=3)


@pytest.fixture(scope="module")
def old(chase, tmp_path_factory):
    """A run of each trainer."""
    made = {}
    for trainer, package in PACKAGES.items():
        pytest.importorskip(package)
        made[trainer] = tmp_path_factory.mktemp(trainer)
        config = TrainConfig("Chase", made[trainer], 512, trainer, 16, ppo=PPO)
        train(config, env=chase(16, True, autoreset_mode(config)))
    return made


@pytest.mark.parametrize("trainer", PACKAGES)
@pytest.mark.parametrize("before", PACKAGES)
def test_it_begins_with_what_the_other_is_evaluated_with(old, before, trainer, chase, tmp_path):
    ppo = replace(PPO, initial_std=0.25)
    config = TrainConfig("Chase", tmp_path, 256, trainer, 16, ppo=ppo, start_from=str(old[before]))
    result = train(config, env=chase(16, True, autoreset_mode(config)))
    source = Checkpoint.load(checkpoints(old[before])[-1]).acting
    first, last = (Checkpoint.load(checkpoints(tmp_path)[i]) for i in (0, -1))
    assert first.steps == 0 and result.steps == 256
    assert first.policy["log_std"].mean().exp() == pytest.approx(0.25)
    for name, value in source.items():
        if name != "log_std":
            assert torch.equal(first.policy[name], value), name
    assert not all(torch.equal(last.policy[k], v) for k, v in source.items())
    assert f"--start-from {old[before]}" in config.command()


def test_how_the_networks_were_trained_is_kept(old, chase, tmp_path):
    """Over two runs and a stop."""
    chain = [old["sb3"], tmp_path / "second", tmp_path / "third"]
    for before, out in itertools.pairwise(chain):
        config = TrainConfig("Chase", out, 128, num_envs=16, ppo=PPO, start_from=str(before))
        train(config, env=chase(16, True, autoreset_mode(config)))
    train(replace(config, steps=256), resume=True, env=chase(16, True, autoreset_mode(config)))
    parents = [Checkpoint.load(checkpoints(run)[-1]) for run in chain[:2]]
    state = Checkpoint.load(checkpoints(chain[2])[-1])
    assert [a["steps"] for a in state.ancestors] == [512, 128] and state.steps == 256
    assert [a["seconds"] for a in state.ancestors] == [p.seconds for p in parents]
    assert [a["stretches"] for a in state.ancestors] == [p.stretches for p in parents]


def test_what_cannot_be_begun_with_is_one_clear_error(old, chase, tmp_path):
    config = TrainConfig("Chase", tmp_path / "new", 256, num_envs=16, ppo=PPO)
    env = chase(16, True, autoreset_mode(config))
    wider = replace(config, ppo=replace(PPO, hidden=(17,)), start_from=str(old["sb3"]))
    with pytest.raises(InvalidOptionError, match=r"other shapes .*actor.*ppo\.hidden"):
        train(wider, env=env)
    with pytest.raises(FileFormatError, match="checkpoints of a run"):  # before it makes "Chase"
        train(replace(config, start_from=str(tmp_path / "nothing")))
    with pytest.raises(InvalidOptionError, match="start_from must be a path"):
        replace(config, start_from=7)
    assert not (tmp_path / "new").exists() or not checkpoints(tmp_path / "new")


def test_a_run_that_goes_on_keeps_where_it_began(old, chase, tmp_path):
    config = TrainConfig("Chase", tmp_path, 128, num_envs=16, ppo=PPO, start_from=str(old["sb3"]))
    env = chase(16, True, autoreset_mode(config))
    train(config, env=env)
    assert train(replace(config, steps=256), resume=True, env=env).steps == 256
    with pytest.raises(InvalidOptionError, match="start_from of a run that goes on"):
        train(replace(config, start_from=""), resume=True, env=env)


def test_a_published_policy_has_what_is_needed(old, chase, tmp_path):
    state = Checkpoint.load(checkpoints(old["sb3"])[-1])
    replace(state, policy=state.acting, average=None, optimizer={}, history=[]).save(tmp_path / "p")
    config = TrainConfig(
        "Chase", tmp_path / "new", 128, num_envs=16, ppo=PPO, start_from=str(tmp_path / "p")
    )
    assert train(config, env=chase(16, True, autoreset_mode(config))).steps == 128
