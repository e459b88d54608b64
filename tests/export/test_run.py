import json
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
import torch

import omni_envs  # noqa: F401  (registers the environments)
from omni_envs.envs import OmniVectorEnv
from omni_envs.errors import (
    FileFormatError,
    InvalidDataError,
    InvalidOptionError,
    UnknownNameError,
)
from omni_envs.export import closed_loop, export_run
from omni_envs.export.description import describe
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


def test_a_file_is_proved_and_described(run):
    rows = export_run(run)
    assert rows["parity_max_abs"] <= 1e-5 and rows["steps"] == 32
    assert rows["closed_loop_return"] == pytest.approx(rows["closed_loop_return_network"], rel=1e-3)
    sidecar = json.loads(Path(rows["sidecar"]).read_text())
    assert sidecar["profile"] == "beyondmimic" and sidecar["robot"] == "g1"
    assert sidecar["action"]["trained_as"] == "feedforward"
    assert sidecar["checks"]["parity_max_abs"] == rows["parity_max_abs"]


def test_a_file_that_acts_otherwise_than_the_network_is_refused(run):
    from omni_envs.training.config import TrainConfig

    file = OnnxPolicy(export_run(run)["path"])
    actor = load_actor(find_checkpoint(run))
    with torch.no_grad():
        actor.output.bias += 0.5
    with pytest.raises(InvalidDataError, match="return in closed loop"):
        closed_loop.closed_loop(TrainConfig.load(run), NetworkPolicy(actor), file)


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


def test_several_motions_do_not_fit_into_one_file(motion):
    env = OmniVectorEnv(1, num_threads=1, reference=[motion, motion])
    with pytest.raises(InvalidOptionError, match="holds one motion; the environment has 2"):
        describe(env)
