import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
pytest.importorskip("imageio")
pytest.importorskip("matplotlib")

from omni_envs.cli import main
from omni_envs.errors import InvalidOptionError
from omni_envs.export import export_run
from omni_envs.publish import CARD, MOTION, STRIP, publish
from omni_envs.references import open_reference
from omni_envs.robots import G1
from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import TrainConfig
from omni_envs.training.evaluate import evaluate_run
from omni_envs.training.network_policy import find_checkpoint, load_actor
from omni_envs.training.onnx_policy import OnnxPolicy
from omni_envs.training.recipes import RECIPES
from omni_envs.training.run import train


@pytest.fixture(scope="module")
def run(sway, tmp_path_factory):
    folder = tmp_path_factory.mktemp("publish")
    reference = str(sway(12).save(folder / "motion.npz"))
    config = RECIPES["small"].config(
        "OmniEnvs/G1BoxCarry-v0",
        folder / "run",
        64,
        num_envs=4,
        num_threads=1,
        env_options={"reference": reference},
        ppo={
            "rollout_steps": 8,
            "hidden": (8,),
            "epochs": 1,
            "minibatches": 1,
            "average_updates": 3,
        },
    )
    train(config)
    # As if it had begun with a run of two hours.
    state = Checkpoint.load(find_checkpoint(config.out))
    state.ancestors = [{"steps": 2_000_000, "seconds": 7200.0, "stretches": state.stretches}]
    state.save(config.out)
    return config.out


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    out = tmp_path_factory.mktemp("policies") / "sway"
    publish(run, out, episodes=6)
    return out


def test_the_folder_holds_what_a_policy_needs(run, folder):
    names = {p.name for p in folder.iterdir()}
    assert names == {
        CARD, STRIP, "checkpoints", "config.json", "curve.csv", "curve.png", "evaluation.json",
        "policy.json", "policy.onnx", MOTION,
    }  # fmt: skip
    figures = json.loads((folder / "evaluation.json").read_text())
    card = (folder / CARD).read_text()
    assert figures["episodes"] == 6 and figures["steps"] == 64
    assert 0.0 <= figures["carried_rate"] <= figures["success_rate"]
    assert f"**{figures['success_rate']:.1%}**" in card
    config = TrainConfig.load(folder)
    assert config.steps == 64  # those that it got, whatever was asked for
    trained = replace(TrainConfig.load(run), out=Path("runs/sway"), evaluation_episodes=6)
    parent = replace(trained, out=Path("runs/sway_1"), steps=2_000_000)
    child = replace(trained, start_from="runs/sway_1")
    assert f"$ {parent.command()}\n$ {child.command()}\n" in card and "Apache-2.0" in card
    assert "2.0 million control steps in 2.0 hours on " in card
    assert f"{config.num_threads} CPU core" in card
    with (folder / "curve.csv").open() as file:
        assert float(list(csv.DictReader(file))[-1]["steps"]) == 64


def test_the_folder_is_small_and_names_no_path_of_this_machine(run, folder):
    assert sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) < 5e6
    reference = TrainConfig.load(run).env_options["reference"]  # the user's own, to be kept
    for name in ("config.json", "policy.json", CARD):
        text = (folder / name).read_text().replace(json.dumps(reference)[1:-1], "")
        assert str(folder.parent) not in text and str(run.parent) not in text, name
    assert OnnxPolicy(folder / "policy.onnx").metadata["run_path"] == "runs/sway"
    assert json.loads((folder / "policy.json").read_text())["training"]["out"] == "runs/sway"


def test_the_folder_is_a_run_without_the_optimiser(run, folder):
    (checkpoint,) = (folder / "checkpoints").iterdir()
    assert checkpoint.stat().st_size < 0.6 * find_checkpoint(run).stat().st_size
    whole, slim = load_actor(find_checkpoint(run)), load_actor(find_checkpoint(folder))
    for a, b in zip(whole.parameters(), slim.parameters(), strict=True):
        np.testing.assert_array_equal(a.detach(), b.detach())
    again = evaluate_run(folder)
    published = json.loads((folder / "evaluation.json").read_text())
    assert again.success_rate == published["success_rate"]
    assert again.return_mean == pytest.approx(published["return_mean"])
    assert export_run(folder)["parity_max_abs"] <= 1e-5


def test_the_folder_keeps_its_motion_wherever_it_goes(run, folder, tmp_path, monkeypatch):
    moved = Path(shutil.copytree(folder, tmp_path / "moved"))
    assert json.loads((moved / "config.json").read_text())["env_options"]["reference"] == MOTION
    monkeypatch.chdir(tmp_path)
    for place in (moved, Path("moved")):
        assert Path(TrainConfig.load(place).env_options["reference"]) == place / MOTION
    config = TrainConfig.load("moved")
    original = open_reference(TrainConfig.load(run).env_options["reference"], G1)
    for name in ("qpos", "qvel", "body_positions", "object_poses"):
        kept = getattr(open_reference(config.env_options["reference"], G1), name)
        np.testing.assert_array_equal(kept, getattr(original, name))
    assert evaluate_run("moved").return_mean == pytest.approx(evaluate_run(folder).return_mean)


def test_several_motions_are_not_published(run, tmp_path):
    two = tmp_path / "run"
    shutil.copytree(run, two)
    config = TrainConfig.load(run)
    reference = config.env_options["reference"]
    replace(config, env_options={**config.env_options, "reference": [reference] * 2}).save(two)
    with pytest.raises(InvalidOptionError, match="holds one motion; this one tracks 2"):
        publish(two, tmp_path / "policy", episodes=2)
    assert not (tmp_path / "policy" / "config.json").exists()


def test_training_does_not_go_on_from_it(folder):
    config = TrainConfig.load(folder)
    before = (folder / "config.json").read_text()
    with pytest.raises(InvalidOptionError, match="without what a training needs"):
        train(config, resume=True)
    assert (folder / "config.json").read_text() == before


def test_a_policy_below_the_bar_is_not_published(run, tmp_path):
    with pytest.raises(InvalidOptionError, match="below the 1\\.100 asked for"):
        publish(run, tmp_path / "policy", episodes=2, least=1.1)
    assert not (tmp_path / "policy").exists()


def test_nor_is_one_that_leaves_the_object_where_it_is(run, tmp_path, monkeypatch):
    from omni_envs.training import evaluate

    found = replace(evaluate_run(run, episodes=2), success_rate=0.9, carried_rate=0.1)
    monkeypatch.setattr(evaluate, "evaluate_run", lambda *_, **__: found)
    with pytest.raises(InvalidOptionError, match="object carried of 0\\.100 is below"):
        publish(run, tmp_path / "policy", episodes=2, least=0.8)
    assert not (tmp_path / "policy").exists()


def test_the_command_publishes(run, tmp_path, capsys):
    out = tmp_path / "policy"
    assert main(["publish", str(run), "--out", str(out), "--episodes", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["episodes"] == 2
    assert (out / CARD).is_file()
    assert main(["publish", str(tmp_path / "none"), "--out", str(out)]) == 1
    assert "config.json" in capsys.readouterr().err
