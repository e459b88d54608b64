import csv
import dataclasses
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("tensorboard")
import torch
from gymnasium.vector import AutoresetMode

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.training.checkpoint import Checkpoint, checkpoints
from omni_envs.training.config import PPOConfig, TrainConfig
from omni_envs.training.network_policy import load_actor
from omni_envs.training.run import train
from omni_envs.training.stretches import machines

ROLLOUT = 8 * 16
MODES = {"sb3": AutoresetMode.SAME_STEP, "torchrl": AutoresetMode.DISABLED}
PACKAGES = {"sb3": "stable_baselines3", "torchrl": "torchrl"}

COLUMNS = {
    "steps", "seconds", "steps_per_s", "episode_length", "episode_return", "body_error_m",
    "noise_level", "kl", "surrogate_loss", "value_loss", "entropy", "clip_fraction",
    "learning_rate", "action_std",
}  # fmt: skip


@pytest.fixture(params=MODES)
def trainer(request) -> str:
    """Every trainer makes the same run directory, and resumes alike."""
    pytest.importorskip(PACKAGES[request.param])
    return request.param


@pytest.fixture
def config(trainer):
    def make(out, steps: int = 4 * ROLLOUT, **changes) -> TrainConfig:
        ppo = PPOConfig(rollout_steps=8, epochs=2, minibatches=2, hidden=(16,))
        fields = {"env": "Chase", "out": out, "steps": steps, "num_envs": 16, "ppo": ppo}
        return TrainConfig(**{**fields, "trainer": trainer, **changes})

    return make


@pytest.fixture
def env(chase, trainer):
    return lambda: chase(16, True, MODES[trainer])


def _policy(out):
    return Checkpoint.load(checkpoints(out)[-1]).policy


def _same(one, two) -> bool:
    return all(torch.equal(one[key], two[key]) for key in one)


def test_a_run_directory_holds_what_it_should(config, env, tmp_path):
    result = train(config(tmp_path, checkpoint_every=2), env=env())
    assert result.steps == 4 * ROLLOUT and len(result.history) == 4
    assert TrainConfig.load(tmp_path) == config(tmp_path, checkpoint_every=2)
    steps = [Checkpoint.load(p).steps for p in checkpoints(tmp_path)]
    assert steps == [0, 2 * ROLLOUT, 4 * ROLLOUT]
    assert any((tmp_path / "tensorboard").iterdir())
    with (tmp_path / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(r["steps"]) for r in rows] == [r["steps"] for r in result.history]
    assert set(result.history[-1]) == COLUMNS
    assert 0 < result.history[-1]["episode_length"] <= 20
    assert result.history[-1]["kl"] > 0
    assert 0 < result.history[-1]["body_error_m"] < 1.5


def test_the_history_of_a_task_with_an_object_tells_where_it_is(trainer, config, tmp_path):
    task = {"env": "OmniEnvs/G1BoxCarry-v0", "env_options": {"randomization": {"variants": 1}}}
    row = train(config(tmp_path, steps=2 * ROLLOUT, **task)).history[-1]
    # It starts within 5 cm per axis of its reference.
    assert set(row) == COLUMNS | {"object_error_m"} and 0.005 < row["object_error_m"] < 0.2


def test_an_average_of_the_weights_acts_and_the_newest_go_on(config, env, tmp_path):
    made = config(tmp_path)
    made = dataclasses.replace(made, ppo=dataclasses.replace(made.ppo, average_updates=3))
    train(made, env=env())
    state = Checkpoint.load(checkpoints(tmp_path)[-1])
    assert (
        state.average["updates"] == 4 and Checkpoint.load(checkpoints(tmp_path)[0]).average is None
    )
    name = "action_net.weight"
    assert not torch.equal(state.acting[name], state.policy[name])
    assert torch.equal(state.acting["value_net.weight"], state.policy["value_net.weight"])
    acts = load_actor(checkpoints(tmp_path)[-1])
    assert torch.equal(acts.output.weight, state.average["weights"][name])
    train(dataclasses.replace(made, steps=6 * ROLLOUT), resume=True, env=env())
    assert Checkpoint.load(checkpoints(tmp_path)[-1]).average["updates"] == 6
    # What is learnt does not depend on it.
    other = tmp_path / "other"
    train(config(other), env=env())
    assert _same(state.policy, _policy(other))


def test_a_resumed_run_goes_on_from_the_last_checkpoint(config, env, tmp_path):
    train(config(tmp_path), env=env())
    first = _policy(tmp_path)
    longer = train(config(tmp_path, 6 * ROLLOUT), resume=True, env=env())
    assert longer.steps == 6 * ROLLOUT
    assert [row["steps"] for row in longer.history] == [k * ROLLOUT for k in range(1, 7)]
    seconds = [row["seconds"] for row in longer.history]
    assert seconds == sorted(seconds)
    assert not _same(first, _policy(tmp_path))


def test_figures_go_on_where_they_were(config, env, tmp_path):
    """Right after a restart only short episodes have finished: alone they would mislead."""
    train(config(tmp_path, 20 * ROLLOUT), env=env())
    longer = train(config(tmp_path, 21 * ROLLOUT), resume=True, env=env())
    before, after = (row["episode_length"] for row in longer.history[-2:])
    assert after == pytest.approx(before, rel=0.2)
    saved = Checkpoint.load(checkpoints(tmp_path)[-1]).episodes
    assert np.mean([length for _, length in saved]) == pytest.approx(after)


def test_resuming_a_finished_run_changes_nothing(config, env, tmp_path):
    train(config(tmp_path), env=env())
    first = _policy(tmp_path)
    again = train(config(tmp_path), resume=True, env=env())
    assert again.steps == 4 * ROLLOUT and _same(first, _policy(tmp_path))


def test_the_checkpoint_tells_what_trained(config, env, tmp_path, monkeypatch):
    train(config(tmp_path, num_threads=1), env=env())
    (stretch,) = Checkpoint.load(checkpoints(tmp_path)[-1]).stretches
    assert (stretch["from"], stretch["machine"]) == (0, "1 CPU core")
    for k, name in enumerate(("16 CPU cores, a GPU", "1 CPU core"), start=5):
        monkeypatch.setattr("omni_envs.training.run.machine", lambda *_, name=name: name)
        train(config(tmp_path, k * ROLLOUT), resume=True, env=env())
    told = Checkpoint.load(checkpoints(tmp_path)[-1]).stretches
    assert [s["from"] for s in told] == [0, 4 * ROLLOUT, 5 * ROLLOUT]
    assert machines(told) == ["1 CPU core", "16 CPU cores, a GPU"]


def test_resuming_twice_gives_the_same_weights(config, env, tmp_path):
    policies = []
    for name in ("one", "two"):
        train(config(tmp_path / name), env=env())
        train(config(tmp_path / name, 6 * ROLLOUT), resume=True, env=env())
        policies.append(_policy(tmp_path / name))
    assert _same(*policies)


def test_time_limit_ends_the_run(config, env, tmp_path):
    result = train(config(tmp_path, 10**9, time_limit=0.3), env=env())
    assert 0.3 <= result.seconds < 3.0
    assert Checkpoint.load(checkpoints(tmp_path)[-1]).steps == result.steps


def test_a_run_directory_in_use_is_not_overwritten(config, env, tmp_path):
    train(config(tmp_path), env=env())
    with pytest.raises(InvalidOptionError, match="already holds a training run"):
        train(config(tmp_path), env=env())
    with pytest.raises(InvalidOptionError, match="no checkpoint to resume"):
        train(config(tmp_path / "new"), resume=True, env=env())


def test_a_cut_checkpoint_is_one_clear_error(config, env, tmp_path):
    train(config(tmp_path), env=env())
    last = checkpoints(tmp_path)[-1]
    last.write_bytes(last.read_bytes()[:200])
    with pytest.raises(FileFormatError, match=last.name):
        train(config(tmp_path), resume=True, env=env())


def test_progress_is_lines_where_there_is_no_terminal(config, env, tmp_path, capsys):
    train(config(tmp_path / "shown"), progress=True, env=env())
    shown = capsys.readouterr().err
    assert "steps/s" in shown and "100%" in shown and "episode" in shown and "error" in shown
    train(config(tmp_path / "quiet"), progress=False, env=env())
    assert capsys.readouterr().err == ""


TRAINEE = """
import sys
sys.path.insert(0, sys.argv[2])
from conftest import Chase
from gymnasium.vector import AutoresetMode
from pathlib import Path
from omni_envs.training.config import PPOConfig, TrainConfig
from omni_envs.training.run import train
ppo = PPOConfig(rollout_steps=8, epochs=2, minibatches=2, hidden=(16,))
config = TrainConfig(
    "Chase", Path(sys.argv[1]), 10**9, sys.argv[3], num_envs=16, checkpoint_every=1, ppo=ppo
)
train(config, env=Chase(16, True, AutoresetMode[sys.argv[4]]))
"""


def test_a_killed_run_resumes(trainer, env, tmp_path):
    folder, mode = os.path.dirname(__file__), MODES[trainer].name
    command = [sys.executable, "-c", TRAINEE, str(tmp_path), folder, trainer, mode]
    trainee = subprocess.Popen(command)
    try:
        deadline = time.monotonic() + 60
        while len(checkpoints(tmp_path)) < 3:
            assert trainee.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
    finally:
        trainee.send_signal(signal.SIGKILL)
        trainee.wait()
    reached = Checkpoint.load(checkpoints(tmp_path)[-1])
    config = dataclasses.replace(TrainConfig.load(tmp_path), steps=reached.steps + 2 * ROLLOUT)
    result = train(config, resume=True, env=env())
    assert result.steps == reached.steps + 2 * ROLLOUT
    assert repr(list(result.history[:-2])) == repr(reached.history)  # NaN is not equal to itself
