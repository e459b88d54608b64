import json

import pytest

pytest.importorskip("matplotlib")

from omni_envs.cli import main
from omni_envs.training.config import TrainConfig
from omni_envs.training.curve import write_history


@pytest.fixture
def runs(tmp_path):
    made = []
    for trainer in ("sb3", "torchrl"):
        for seed in range(2):
            out = tmp_path / f"{trainer}{seed}"
            TrainConfig("X", out, 1000, trainer, seed=seed).save()
            row = {"episode_length": 20.0, "episode_return": 1.0 + seed, "body_error_m": 0.1}
            write_history(out, [{"steps": s, **row} for s in (100.0, 200.0)])
            made.append(str(out))
    return made


def test_json(runs, tmp_path, capsys):
    path = tmp_path / "curves.png"
    assert main(["curves", *runs, "--out", str(path), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["path"] == str(path) and path.stat().st_size > 10_000
    assert printed["steps"] == 200
    for name in ("trainer sb3", "trainer torchrl"):
        group = printed["groups"][name]
        assert group["runs"] == 2
        assert group["episode_return"] == pytest.approx({"mean": 1.5, "std": 0.5**0.5})


def test_table(runs, tmp_path, capsys):
    assert main(["curves", *runs, "--out", str(tmp_path / "curves.png")]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "trainer torchrl: episode_return" in shown and "1.5 ± 0.71" in shown


def test_a_missing_run_is_one_line_and_status_1(tmp_path, capsys):
    assert main(["curves", str(tmp_path / "nowhere")]) == 1
    assert "config.json" in capsys.readouterr().err
