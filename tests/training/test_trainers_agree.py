"""Both trainers do the same arithmetic: one recipe, written twice."""

from copy import deepcopy
from dataclasses import fields

import pytest
from gymnasium.vector import AutoresetMode

pytest.importorskip("stable_baselines3")
pytest.importorskip("torchrl")
import torch
from tensordict import TensorDict
from torchrl.collectors import Collector

from omni_envs.training.config import PPOConfig
from omni_envs.training.device import read
from omni_envs.training.ppo import Rollout, TrackingPPO
from omni_envs.training.sb3_vec_env import SB3VecEnv
from omni_envs.training.torchrl_env import make_torchrl_env
from omni_envs.training.torchrl_network import TrackingNetwork, actor_and_critic
from omni_envs.training.torchrl_ppo import TensorDictPPO

CONFIG = PPOConfig(rollout_steps=16, epochs=3, minibatches=2, hidden=(32, 16), gamma=0.9)
NUM_ENVS = 32


def _sb3(chase, config: PPOConfig = CONFIG) -> TrackingPPO:
    return TrackingPPO(SB3VecEnv(chase(NUM_ENVS)), config, seed=0)


def _torchrl(weights, config: PPOConfig = CONFIG) -> TensorDictPPO:
    network = TrackingNetwork(
        2, 4, torch.full((2,), -2.0), torch.full((2,), 2.0), config.hidden, config.initial_std
    )
    network.load_state_dict(weights)
    return TensorDictPPO(network, *actor_and_critic(network, ("policy", "critic")), config)


def _trained(chase, config: PPOConfig = CONFIG) -> TrackingPPO:
    """A few updates in: clipping, normalisers and learning rate are at work."""
    learner = _sb3(chase, config)
    learner.learn(3 * 16 * NUM_ENVS)
    return learner


def _batch(rollout: Rollout) -> TensorDict:
    entries = {
        **rollout.observations,
        "action": rollout.actions,
        "action_log_prob": rollout.log_probability,
        "loc": rollout.mean,
        "scale": rollout.std,
        "state_value": rollout.values[:, None],
        "value_target": rollout.returns[:, None],
        "advantage": rollout.advantages[:, None],
    }
    return TensorDict(entries, [len(rollout.actions)])


@pytest.mark.parametrize("value_clip", [0.0, 0.2])
def test_same_batch_same_losses_and_gradient(chase, value_clip):
    config = PPOConfig(**{**vars(CONFIG), "value_clip": value_clip, "value_weight": 0.7})
    learner = _trained(chase, config)
    ppo, rollout = _torchrl(learner.policy.state_dict(), config), learner._rollout()
    with torch.no_grad():  # as after some gradient steps: nothing is at its optimum or unclipped
        for one, other in zip(ppo.network.parameters(), learner.policy.parameters(), strict=True):
            one.add_(0.05 * torch.randn(one.shape))
            other.copy_(one)
    learner.policy.optimizer.zero_grad()
    (expected,) = read([learner._actor_backward(rollout) | learner._critic_backward(rollout)])
    batch = _batch(rollout)
    (found,) = read([ppo.actor_backward(batch) | ppo.critic_backward(batch)])
    assert 0.02 < expected["clip_fraction"] < 0.98
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6)
    for (name, one), other in zip(
        ppo.network.named_parameters(), learner.policy.parameters(), strict=True
    ):
        torch.testing.assert_close(one.grad, other.grad, rtol=1e-4, atol=1e-6, msg=name)


def test_same_rollout_same_gradient_steps(chase):
    learner = _trained(chase)
    ppo, rollout = _torchrl(learner.policy.state_dict()), learner._rollout()
    ppo.optimizer.load_state_dict(deepcopy(learner.policy.optimizer.state_dict()))
    ppo.learning_rate = learner.current_learning_rate
    torch.manual_seed(1)
    learner._update(rollout)
    torch.manual_seed(1)
    figures = ppo.update(_batch(rollout))
    assert figures == pytest.approx(learner.figures, rel=1e-3, abs=1e-5)
    _assert_same_weights(ppo, learner, 1e-5)


@pytest.mark.parametrize("adapt_every", ["minibatch", "update"])
def test_the_learning_rate_takes_the_same_way(chase, adapt_every):
    config = PPOConfig(**{**vars(CONFIG), "desired_kl": 0.001, "adapt_every": adapt_every})
    learner = _sb3(chase, config)
    learner.learn(16 * NUM_ENVS)  # the first rollout only feeds the normalisers
    ppo, rollout = _torchrl(learner.policy.state_dict(), config), learner._rollout()
    rates = {"sb3": [], "torchrl": []}
    for seed in range(12):  # steps over the same rollout lead further and further from it
        torch.manual_seed(seed)
        learner._update(rollout)
        torch.manual_seed(seed)
        ppo.update(_batch(rollout))
        rates["sb3"].append(learner.current_learning_rate)
        rates["torchrl"].append(ppo.learning_rate)
    assert len(set(rates["sb3"])) > 3
    assert rates["torchrl"] == rates["sb3"]


OTHER = PPOConfig(
    rollout_steps=12,
    epochs=2,
    minibatches=3,
    learning_rate=3e-4,
    critic_learning_rate=2e-3,
    desired_kl=0.02,
    adapt_every="update",
    gamma=0.8,
    gae_lambda=0.9,
    clip=0.1,
    value_clip=0.0,
    value_weight=0.5,
    entropy_weight=0.02,
    action_weight=0.05,
    max_grad_norm=0.1,
    hidden=(24,),
    initial_std=0.3,
    average_updates=4,
)
"""Another value of every hyper-parameter: one that a trainer does not heed shows."""


def test_every_hyper_parameter_is_another():
    same = [f.name for f in fields(PPOConfig) if getattr(OTHER, f.name) == f.default]
    assert not same


@pytest.mark.parametrize("config", [CONFIG, OTHER], ids=["usual", "other"])
def test_same_chance_same_training(chase, config):
    """With the same random numbers both collect, bootstrap and learn the same."""
    updates, frames = 5, config.rollout_steps * NUM_ENVS

    class Patient(chase):
        """Stays in the start that a seed gave until it is told to start anew."""

        def reset(self, *, seed=None, options=None):
            if seed is None and options is None:
                return self._observe(), {}
            return super().reset(seed=seed, options=options)

    learner = _sb3(chase, config)
    ppo = _torchrl(learner.policy.state_dict(), config)
    learner.env.seed(5)
    torch.manual_seed(2)
    learner.learn(updates * frames)

    env = make_torchrl_env(Patient(NUM_ENVS, True, AutoresetMode.DISABLED))
    env.set_seed(5)
    collector = Collector(
        env,
        ppo.actor,
        frames_per_batch=frames,
        total_frames=updates * frames,
        auto_register_policy_transforms=False,
    )
    torch.manual_seed(2)
    figures = [ppo.learn(rollout) for rollout in collector]
    collector.shutdown()
    assert figures[-1] == pytest.approx(learner.figures, rel=1e-2, abs=1e-4)
    _assert_same_weights(ppo, learner, 1e-4)


def _assert_same_weights(ppo: TensorDictPPO, learner: TrackingPPO, tolerance: float) -> None:
    expected = learner.policy.state_dict()
    for name, weight in ppo.network.state_dict().items():
        torch.testing.assert_close(
            weight, expected[name], rtol=tolerance, atol=tolerance, msg=f"{name} differs"
        )
