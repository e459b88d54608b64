import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
import torch

import omni_envs  # noqa: F401  (registers the environments)
from omni_envs.cli import main
from omni_envs.errors import (
    FileFormatError,
    InvalidDataError,
    UnknownNameError,
)
from omni_envs.export import PROFILES, closed_loop, export_run
from omni_envs.training.config import TrainConfig
from omni_envs.training.network_policy import NetworkPolicy, find_checkpoint, load_actor
from omni_envs.training.onnx_policy import OnnxPolicy
from omni_envs.training.recipes import RECIPES
from omni_envs.training.run import train


@pytest.fixture(scope="module")
def run(motion, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    reference = str(motion.save(folder / "motion.npz"))
    config = RECIPES["small"].config(
        "OmniEnvs/G1BoxCarry-v0",
        folder / "run",
        32,
        num_envs=4,
        num_threads=1,
        env_options={"reference": reference},
        ppo={"rollout_steps": 8, "hidden": (8,), "epochs": 1, "minibatches": 1},
    )
    train(config)
    return config.out


@pytest.fixture(scope="module")
def torso_run(motion, tmp_path_factory) -> Path:
    """What every stack can feed: no estimated state, the torso compared with the motion."""
    folder = tmp_path_factory.mktemp("torso")
    reference = str(motion.save(folder / "motion.npz"))
    options = {"reference": reference, "anchor": "torso"}
    config = RECIPES["small"].config(
        "OmniEnvs/G1BoxCarry-v0",
        folder / "run",
        32,
        num_envs=4,
        num_threads=1,
        env_options={**options, "observation": {"state_estimation": False}},
        ppo={"rollout_steps": 8, "hidden": (8,), "epochs": 1, "minibatches": 1},
    )
    train(config)
    return config.out


@pytest.mark.parametrize("profile", PROFILES)
def test_every_profile_is_proved_in_closed_loop(torso_run, profile):
    rows = export_run(torso_run, profile=profile)
    folder = torso_run if profile == "beyondmimic" else torso_run / profile
    assert rows["path"] == str(folder / "policy.onnx") and rows["parity_max_abs"] <= 1e-5
    assert rows["closed_loop_return"] == pytest.approx(rows["closed_loop_return_network"], rel=1e-3)
    sidecar = json.loads(Path(rows["sidecar"]).read_text())
    assert sidecar["profile"] == profile and sidecar["action"]["trained_as"] == "feedforward"
    assert all((folder / name).is_file() for name in sidecar["files"])
    assert sidecar["observation"]["size"] == 154


def test_files_of_a_stack_that_fail_their_proof_do_not_stay(torso_run, tmp_path, monkeypatch):
    def fails(*_):
        raise InvalidDataError("file", "return", "another", "this one")

    monkeypatch.setattr(closed_loop, "closed_loop", fails)
    with pytest.raises(InvalidDataError):
        export_run(torso_run, profile="unitree", out=tmp_path / "policy.onnx")
    assert list(tmp_path.iterdir()) == []


def test_the_command_takes_the_profile(run, torso_run, tmp_path, capsys):
    out = str(tmp_path / "policy.onnx")
    assert main(["export", str(torso_run), "--profile", "unitree", "--out", out, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["path"] == out
    assert main(["export", str(run), "--profile", "holosoma"]) == 1
    assert "Train with observation=" in capsys.readouterr().err


def test_a_file_is_proved_and_described(run):
    rows = export_run(run)
    assert rows["parity_max_abs"] <= 1e-5 and rows["steps"] == 32
    assert rows["closed_loop_return"] == pytest.approx(rows["closed_loop_return_network"], rel=1e-3)
    sidecar = json.loads(Path(rows["sidecar"]).read_text())
    assert sidecar["profile"] == "beyondmimic" and sidecar["robot"] == "g1"
    assert sidecar["action"]["trained_as"] == "feedforward"
    assert sidecar["checks"]["parity_max_abs"] == rows["parity_max_abs"]


def test_a_file_that_acts_otherwise_than_the_network_is_refused(run):
    file = OnnxPolicy(export_run(run)["path"])
    actor = load_actor(find_checkpoint(run))
    with torch.no_grad():
        actor.output.bias += 0.5
    with pytest.raises(InvalidDataError, match="return in closed loop"):
        closed_loop.closed_loop(TrainConfig.load(run), NetworkPolicy(actor), file)


@pytest.mark.parametrize(("rounded", "passes"), [(10.006, True), (10.004, False)])
def test_a_file_may_differ_as_last_digits_do(monkeypatch, torso_run, tmp_path, rounded, passes):
    """A return of 10 that the file misses by 0.05, and the rounded network by some 0.005."""
    returns = iter([10.05, 10.0, rounded])
    monkeypatch.setattr(
        closed_loop, "play", lambda *_, **__: SimpleNamespace(returns=np.array([next(returns)]))
    )
    config, file = TrainConfig.load(torso_run), SimpleNamespace(path=tmp_path / "policy.onnx")
    if passes:
        assert closed_loop.closed_loop(config, None, file).network_return == 10.0
    else:
        with pytest.raises(InvalidDataError, match="closed loop"):
            closed_loop.closed_loop(config, None, file)


def test_a_file_that_fails_its_proof_does_not_stay(run, tmp_path, monkeypatch):
    def fails(*_):
        raise InvalidDataError("file", "return", "another", "this one")

    monkeypatch.setattr(closed_loop, "closed_loop", fails)
    with pytest.raises(InvalidDataError):
        export_run(run, out=tmp_path / "policy.onnx")
    assert list(tmp_path.iterdir()) == []


def test_bad_input_is_one_clear_error(run, tmp_path):
    with pytest.raises(UnknownNameError, match=r"profile 'ros'.*Valid: beyondmimic"):
        export_run(run, profile="ros")
    with pytest.raises(FileFormatError, match=r"config\.json"):
        export_run(tmp_path)
    (tmp_path / "config.json").write_bytes((run / "config.json").read_bytes())
    with pytest.raises(FileFormatError, match="checkpoints of a run; found none"):
        export_run(tmp_path)
