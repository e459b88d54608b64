import dataclasses
import json
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest
import tyro

pytest.importorskip("stable_baselines3")
pytest.importorskip("onnxruntime")
pytest.importorskip("matplotlib")

from omni_envs.export import export_run
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1
from omni_envs.training.config import TrainConfig
from omni_envs.training.evaluate import evaluate_run
from omni_envs.training.onnx_policy import OnnxPolicy

sys.path.insert(0, str(Path(__file__).parents[1]))
import train

KEYS = {
    "success_rate", "success_ci95", "episode_length_mean", "body_error_mean_m", "steps", "seconds",
}  # fmt: skip


@pytest.fixture(scope="module")
def reference(tmp_path_factory) -> Path:
    """The G1 bending its knees, without object."""
    qpos = np.tile(G1.default_qpos, (30, 1))
    wave = 0.2 * (1 - np.cos(np.linspace(0, np.pi, 30)))
    for i, name in enumerate(G1.joint_names):
        if "knee" in name:
            qpos[:, 7 + i] += wave
    path = tmp_path_factory.mktemp("reference") / "bend.npz"
    return reference_from_qpos(G1, 50.0, qpos).save(path)


def _words(out: Path, reference: Path, *more: str) -> list[str]:
    options = json.dumps({"reference": str(reference), "action": {"mode": "residual"}})
    ppo = json.dumps({"hidden": [16], "rollout_steps": 8, "epochs": 1})
    return [
        "--steps", "64", "--out", str(out), "--num-envs", "4", "--num-threads", "1",
        "--episodes", "5", "--env-options", options, "--ppo", ppo, *more,
    ]  # fmt: skip


@pytest.fixture(scope="module", params=train.PACKAGES)
def run(request, reference, tmp_path_factory) -> Path:
    """A run of each trainer: what follows does not tell them apart."""
    pytest.importorskip(train.PACKAGES[request.param][0])
    out = tmp_path_factory.mktemp("run") / "bend"
    assert train.main(_words(out, reference, "--json", "--trainer", request.param)) == 0
    return out


def test_trains_evaluates_and_exports(run):
    for name in (
        "config.json", "checkpoints", "tensorboard", "evaluation.json", "policy.onnx",
        "policy.json", "curve.png", "curve.csv",
    ):  # fmt: skip
        assert (run / name).exists(), name
    evaluation = json.loads((run / "evaluation.json").read_text())
    assert set(evaluation) >= KEYS
    assert evaluation["steps"] == 64 and evaluation["episodes"] == 5
    low, high = evaluation["success_ci95"]
    assert 0 <= low <= evaluation["success_rate"] <= high <= 1
    sidecar = json.loads((run / "policy.json").read_text())
    assert sidecar["checks"]["parity_max_abs"] <= 1e-5
    assert sidecar["checks"]["closed_loop_return"] == pytest.approx(
        sidecar["checks"]["closed_loop_return_network"], rel=1e-3
    )


def test_file_and_network_get_the_same_evaluation(run):
    network, file = evaluate_run(run), evaluate_run(run, file=run / "policy.onnx")
    assert file.episode_length_mean == network.episode_length_mean
    assert file.return_mean == pytest.approx(network.return_mean, rel=1e-3)
    assert file.body_error_mean_m == pytest.approx(network.body_error_mean_m, rel=1e-3)
    assert file.window_seconds_mean == network.window_seconds_mean


def test_export_goes_where_it_is_told(run, tmp_path):
    rows = export_run(run, out=tmp_path / "other.onnx")
    assert rows["path"] == str(tmp_path / "other.onnx")
    assert OnnxPolicy(rows["path"]).metadata["run_path"] == str(run)
    assert json.loads(Path(rows["sidecar"]).read_text())["observation"]["size"] == 160


def test_resumes_and_shows_a_table(run, reference, capsys):
    words = ["--steps", "96", "--out", str(run), "--resume", "--episodes", "5"]
    assert train.main(words) == 0
    shown = capsys.readouterr()
    assert "success_rate" in shown.out and "steps/s" in shown.err
    assert json.loads((run / "evaluation.json").read_text())["steps"] == 96


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("--env-options", "{"), "--env-options: expected JSON"),
        (("--ppo", "[1]"), "--ppo: expected a JSON object"),
        (("--ppo", '{"gama": 1}'), "unknown ['gama']"),
        (("--env-options", '{"rewards": {}}'), "rewards"),
        (("--resume",), "config.json"),
        (("--env", "OmniEnvs/G1BoxCary-v0"), "G1BoxCarry"),
        (("--steps", "0"), "steps must be positive"),
        (("--start-from", "nowhere"), "nowhere"),
    ],
)
def test_bad_input_is_one_line_and_status_1(tmp_path, reference, capsys, more, message):
    assert train.main(_words(tmp_path / "new", reference, *more)) == 1
    error = capsys.readouterr().err.strip()
    assert message in error and error.startswith("train.py: ") and "\n" not in error


def test_a_run_that_goes_on_starts_from_no_other(run, capsys):
    words = ["--steps", "96", "--out", str(run), "--resume", "--start-from", str(run)]
    assert train.main(words) == 1
    assert "--start-from: a run that goes on has networks already" in capsys.readouterr().err


def test_the_device_is_the_runs_unless_another_is_asked_for(run, tmp_path):
    def config(*words: str) -> TrainConfig:
        steps = ["--steps", "64", "--out", str(run)]
        return train.make_config(tyro.cli(train.Arguments, args=[*steps, *words]))

    assert config().device == "cpu" and config("--device", "cuda").device == "cuda"
    assert config("--resume").device == TrainConfig.load(run).device == "cpu"
    assert config("--resume", "--device", "auto").device == "auto"


def test_the_command_in_the_sidecar_repeats_the_run(run):
    command = json.loads((run / "policy.json").read_text())["command"]
    words = shlex.split(command)
    assert words[:2] == ["python", "train.py"]
    config = TrainConfig.load(run)
    again = train.make_config(tyro.cli(train.Arguments, args=words[2:]))
    assert dataclasses.replace(again, num_threads=config.num_threads) == config


def test_several_motions_are_trained_and_evaluated_without_a_file(reference, tmp_path, capsys):
    options = json.dumps({"reference": [str(reference)] * 2})
    words = _words(tmp_path / "run", reference, "--json", "--env-options", options)
    assert train.main(words) == 0
    shown = capsys.readouterr()
    figures = json.loads(shown.out)
    assert [m["episodes"] for m in figures["motions"]] == [3, 2] and "path" not in figures
    assert "a policy file holds one motion" in shown.err
    assert not (tmp_path / "run" / "policy.onnx").exists()


def test_a_used_run_directory_is_refused(run, reference, capsys):
    assert train.main(_words(run, reference)) == 1
    assert "already holds a training run" in capsys.readouterr().err
