"""A run that goes on with other settings: what may change, and the commands that repeat it."""

import shlex
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
import tyro

pytest.importorskip("stable_baselines3")
import train as script
from omni_envs.errors import InvalidOptionError
from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import TrainConfig
from omni_envs.training.recipes import RECIPES
from omni_envs.training.stretches import (
    check_changes,
    commands,
    lengthened,
    machines,
    set_exploration,
)

ENV = "OmniEnvs/G1BoxCarry-v0"


@pytest.fixture
def config(tmp_path) -> TrainConfig:
    return RECIPES["small"].config(ENV, tmp_path / "run", 1000)


def later(config: TrainConfig, **changes) -> TrainConfig:
    """The settings that going on with these words gives."""
    config.save()
    flags = {"env": ENV, "steps": 2000, "out": config.out, **changes}
    words = [word for k, v in flags.items() for word in (f"--{k.replace('_', '-')}", str(v))]
    return script.make_config(tyro.cli(script.Arguments, args=["--resume", *words]))


def test_options_are_laid_over_the_saved_ones(config):
    now = later(config, num_envs=8, ppo='{"epochs": 3}', training_options='{"physics": "fast"}')
    assert now.num_envs == 8 and now.ppo == replace(config.ppo, epochs=3)
    assert now.training_options == {**config.training_options, "physics": "fast"}
    assert (now.seed, now.env_options) == (config.seed, config.env_options)


def test_every_core_is_a_number_of_threads_too(config):
    assert later(config).num_threads == config.num_threads == 0
    two = later(config, num_threads=2)
    assert two.num_threads == later(two).num_threads == 2
    assert later(two, num_threads=0).num_threads == 0


def test_what_cannot_change_is_refused(config):
    with pytest.raises(InvalidOptionError, match="--env-options"):
        later(config, env_options='{"preset": "beyondmimic"}')
    for changed in (
        replace(config, env_options={"preset": "beyondmimic"}),
        replace(config, trainer="torchrl"),
        replace(config, ppo=replace(config.ppo, hidden=(8,))),
        replace(config, ppo=replace(config.ppo, critic_learning_rate=0.0)),
    ):
        with pytest.raises(InvalidOptionError, match="must stay"):
            check_changes(config, changed)
    check_changes(config, replace(config, num_envs=8, training_options={"physics": "fast"}))


def test_a_stretch_begins_where_settings_or_machine_change(config):
    one = lengthened([], config, 0, "2 CPU cores")
    assert lengthened(one, replace(config, steps=10**6), 500, "2 CPU cores") == one
    two = lengthened(one, config, 500, "16 CPU cores")
    assert [s["from"] for s in two] == [0, 500]
    three = lengthened(two, replace(config, num_envs=8), 500, "2 CPU cores")
    assert [s["from"] for s in three] == [0, 500]  # the second taught nothing
    assert machines(three) == ["2 CPU cores"]


def test_the_commands_repeat_the_run(config):
    """Typed one after the other they lead through the same settings."""
    settings = [
        config,
        replace(config, num_envs=8, num_threads=2, device="auto"),
        replace(
            config,
            num_envs=8,
            num_threads=0,
            device="auto",
            training_options={
                "observation": {"privileged": True},
                "reset": {"start_share": 0.3},
                "reward": {"anchor_position": {"weight": 2.0, "sigma": 0.2}},
            },
            ppo=replace(config.ppo, epochs=3, initial_std=0.3),
        ),
    ]
    stretches = []
    for k, setting in enumerate(settings):
        stretches = lengthened(stretches, setting, 1000 * k, "a machine")
    lines = commands(replace(settings[-1], steps=3000), stretches)
    assert len(lines) == 3
    for k, (line, expected) in enumerate(zip(lines, settings, strict=True)):
        words = shlex.split(line)
        assert words[:2] == ["python", "train.py"] and ("--resume" in words) == (k > 0)
        again = script.make_config(tyro.cli(script.Arguments, args=words[2:]))
        again.save()
        assert again.steps == 1000 * (k + 1)
        assert (again.num_envs, again.device) == (expected.num_envs, expected.device)
        assert again.num_threads == expected.num_threads
        assert asdict(again.ppo) == asdict(expected.ppo)
        # What is gone is None.
        assert _there(again.training_options) == _there(expected.training_options)


def test_the_commands_of_ancestors_come_first(config):
    """A run that began with a run that began with a published policy of an earlier version."""
    first = replace(config, out=Path("elsewhere"), start_from="policies/old")
    second = replace(config, out=Path("policies/x"), start_from="elsewhere", num_envs=8)
    run = replace(config, out=Path("runs/x"), start_from="policies/x", num_envs=16, steps=300)
    parents = [
        {"steps": steps, "seconds": 1.0, "stretches": stretches}
        for steps, stretches in (
            (50, []),
            (100, lengthened([], first, 0, "a machine")),
            (200, lengthened([], second, 0, "a machine")),
        )
    ]
    lines = commands(run, lengthened([], run, 0, "a machine"), parents)
    words = [shlex.split(line)[2:] for line in lines]
    typed = [script.make_config(tyro.cli(script.Arguments, args=w)) for w in words]
    assert [(c.steps, c.num_envs) for c in typed] == [(100, config.num_envs), (200, 8), (300, 16)]
    assert [c.out for c in typed] == [Path("runs/x_2"), Path("runs/x_3"), Path("runs/x")]
    assert [c.start_from for c in typed] == ["policies/old", "runs/x_2", "runs/x_3"]


def _there(options):
    """What is not None, and no empty mappings."""
    if not isinstance(options, dict):
        return options
    kept = {name: _there(value) for name, value in options.items() if value is not None}
    return {name: value for name, value in kept.items() if value != {}}


def test_exploration_starts_again_where_it_is_asked_for(config):
    log_std = torch.tensor([0.1, 0.2, 0.4]).log()
    empty = torch.zeros(0)
    state = Checkpoint(0, 0.0, 0, 1e-3, {"log_std": log_std.clone()}, {}, empty)
    set_exploration(state, config)
    assert torch.equal(state.policy["log_std"], log_std)
    state.stretches = lengthened([], config, 0, "a machine")
    set_exploration(state, config)
    assert torch.equal(state.policy["log_std"], log_std)
    set_exploration(state, replace(config, ppo=replace(config.ppo, initial_std=0.3)))
    std = state.policy["log_std"].exp()
    torch.testing.assert_close(std / std[0], torch.tensor([1.0, 2.0, 4.0]))
    assert std.log().mean().exp().item() == pytest.approx(0.3)
