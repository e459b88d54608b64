"""Every published policy: complete, loadable without pickles, what its card says, and alive."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("onnxruntime")
import torch

from omni_envs.publish import CARD, MOTION, STRIP
from omni_envs.training.config import TrainConfig
from omni_envs.training.evaluate import make_evaluation_env
from omni_envs.training.network_policy import NetworkPolicy, find_checkpoint, load_actor
from omni_envs.training.onnx_policy import OnnxPolicy
from omni_envs.training.rollout import play

FOLDER = Path(__file__).parents[1] / "policies"
POLICIES = sorted(p for p in FOLDER.glob("*") if p.is_dir())
SECONDS = 3.0
LEAST = 0.8

pytestmark = pytest.mark.parametrize("folder", POLICIES, ids=lambda p: p.name)


def test_the_card_is_about_the_evaluation(folder):
    figures = json.loads((folder / "evaluation.json").read_text())
    card = (folder / CARD).read_text()
    assert figures["episodes"] >= 200
    assert f"**{figures['success_rate']:.1%}**" in card
    assert "python train.py --recipe" in card and "Apache-2.0" in card
    for name in (STRIP, MOTION, "curve.png", "curve.csv", "policy.json"):
        assert (folder / name).stat().st_size > 0
    assert sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) < 6e6
    assert str(Path.home()) not in card and "/tmp" not in (folder / "config.json").read_text()


def test_it_succeeds_often_enough(folder):
    figures = json.loads((folder / "evaluation.json").read_text())
    assert figures["success_rate"] >= LEAST
    assert figures["carried_rate"] is None or figures["carried_rate"] >= LEAST


def test_the_file_is_the_network_on_its_own_motion(folder):
    torch.load(find_checkpoint(folder), weights_only=True)
    network = NetworkPolicy(load_actor(find_checkpoint(folder)))
    file = OnnxPolicy(folder / "policy.onnx")
    config = TrainConfig.load(folder)
    env = make_evaluation_env(config, 4, randomized=False)
    try:
        base = env.unwrapped
        scale = base.robot.action_scale * base.config.action.scale
        observations, infos = env.reset(seed=0)
        for _ in range(5):
            frames = infos["frame"]
            action = network(observations, frames)
            target = base.robot.default_joint_array + scale * file(observations, frames)
            observations, _, _, _, infos = env.step(action)
            np.testing.assert_allclose(base.simulation.ctrl, target, atol=1e-3)
    finally:
        env.close()


def test_it_stays_on_its_feet(folder):
    config = TrainConfig.load(folder)
    env = make_evaluation_env(config, 4, randomized=False)
    try:
        network = NetworkPolicy(load_actor(find_checkpoint(folder)))
        steps = round(SECONDS / env.unwrapped.control_step)
        episodes = play(env, network, seed=0, max_steps=steps)
    finally:
        env.close()
    assert not episodes.terminated.any()
    assert episodes.body_error.max() < 0.1
