"""A resumed run goes on in an environment that knows what it knew."""

from dataclasses import replace

import pytest

pytest.importorskip("tensorboard")
import torch

from omni_envs.envs import OmniVectorEnv
from omni_envs.training.checkpoint import Checkpoint, checkpoints
from omni_envs.training.config import PPOConfig, TrainConfig
from omni_envs.training.learner import autoreset_mode
from omni_envs.training.run import train

PACKAGES = {"sb3": "stable_baselines3", "torchrl": "torchrl"}
OPTIONS = {
    "reset": {"start": "adaptive", "growth": {"share": 0.0, "step": 0.1}},
    "termination": {"object_after": 0.01},
    "observation": {"privileged": True},
    "max_episode_steps": 3,
}


@pytest.fixture(params=PACKAGES)
def config(request, tmp_path) -> TrainConfig:
    pytest.importorskip(PACKAGES[request.param])
    ppo = PPOConfig(rollout_steps=20, epochs=1, minibatches=1, hidden=(8,), initial_std=5.0)
    return TrainConfig("Sway", tmp_path, 5 * 320, request.param, num_envs=16, ppo=ppo)


@pytest.fixture
def env(config, sway):
    made = []

    def make():
        mode = autoreset_mode(config)
        env = OmniVectorEnv(16, reference=sway(), num_threads=1, autoreset_mode=mode, **OPTIONS)
        made.append(env)
        return env

    yield make
    for env in made:
        env.close()


def test_growth_gate_and_sampler_go_on_where_they_were(config, env):
    first = env()
    result = train(config, env=first)
    saved = Checkpoint.load(checkpoints(config.out)[-1]).environment
    assert saved == first.learning_state()
    assert saved["noise"]["level"] >= 0.4 and saved["gate"]["open"] and max(saved["failures"]) > 0

    again = env()
    train(config, resume=True, env=again)  # nothing is left to do: the state is that of the end
    assert again.learning_state() == saved

    longer = train(replace(config, steps=6 * 320), resume=True, env=env())
    levels = [row["noise_level"] for row in longer.history]
    assert levels[:5] == [row["noise_level"] for row in result.history]
    assert levels[5] >= levels[4]


def test_the_first_episodes_of_a_resumed_run_have_the_noise_of_the_last(config, env):
    train(config, env=env())
    resumed, starts = env(), []
    inner, reached = resumed._start, Checkpoint.load(checkpoints(config.out)[-1]).environment

    def start(ids, *args):
        starts.append((len(ids), resumed.noise_level))
        inner(ids, *args)

    resumed._start = start
    train(replace(config, steps=6 * 320), resume=True, env=resumed)
    # Resets with a seed come first and forget; the last one of all simulations is what counts.
    assert starts[0] == (16, 0.0)
    last = max(k for k, (count, _) in enumerate(starts) if count == 16 and not starts[k - 1][1])
    assert starts[last][1] == reached["noise"]["level"] >= 0.4
    assert min(level for _, level in starts[last:]) >= reached["noise"]["level"]


def test_a_checkpoint_of_the_version_before_goes_on_with_a_warning(config, env):
    train(config, env=env())
    path = checkpoints(config.out)[-1]
    data = torch.load(path, weights_only=True)
    old = {k: v for k, v in data.items() if k not in ("environment", "device_rng")}
    torch.save({**old, "format": 1}, path)
    assert Checkpoint.load(path).environment is None
    with pytest.warns(UserWarning, match="without the environment's state: .* begin anew"):
        result = train(replace(config, steps=7 * 320), resume=True, env=env())
    assert result.history[5]["noise_level"] < result.history[4]["noise_level"]
    assert Checkpoint.load(checkpoints(config.out)[-1]).environment["noise"]["level"] > 0
