import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

pytest.importorskip("torchrl")
import torch
from tensordict import TensorDict
from torchrl.collectors import Collector

from omni_envs.errors import OmniEnvsError
from omni_envs.training.config import PPOConfig
from omni_envs.training.torchrl_env import make_torchrl_env
from omni_envs.training.torchrl_network import TrackingNetwork, actor_and_critic
from omni_envs.training.torchrl_ppo import TensorDictPPO

SMALL = PPOConfig(rollout_steps=16, epochs=4, minibatches=2, hidden=(32, 32), gamma=0.9)
NUM_ENVS = 32


def _ppo(config: PPOConfig = SMALL, seed: int = 0) -> TensorDictPPO:
    torch.manual_seed(seed)
    network = TrackingNetwork(
        2, 4, torch.full((2,), -2.0), torch.full((2,), 2.0), config.hidden, config.initial_std
    )
    return TensorDictPPO(network, *actor_and_critic(network, ("policy", "critic")), config)


def _rollouts(ppo: TensorDictPPO, chase, count: int, seed: int = 0):
    """Yields rollouts of the policy; what learns in between is seen by the next one."""
    env = make_torchrl_env(chase(NUM_ENVS, True, AutoresetMode.DISABLED))
    env.set_seed(seed)
    frames = ppo.config.rollout_steps * NUM_ENVS
    collector = Collector(
        env,
        ppo.actor,
        frames_per_batch=frames,
        total_frames=count * frames,
        auto_register_policy_transforms=False,
    )
    yield from collector
    collector.shutdown()


def test_learns(chase):
    ppo, lengths = _ppo(), []
    for rollout in _rollouts(ppo, chase, 40):
        ppo.learn(rollout)
        done = rollout["next", "done"]
        lengths.append(rollout["next", "episode_reward"][done].mean().item())
    assert np.mean(lengths[-3:]) > np.mean(lengths[:3]) + 4.0  # the most that 20 steps give is 20


def test_what_was_truncated_is_bootstrapped_and_what_failed_is_not():
    """Three steps of three simulations: γ = 0.9, λ = 0.95, values and rewards by hand."""
    ppo = _ppo(PPOConfig(gamma=0.9, gae_lambda=0.95, hidden=(4,)))
    network = ppo.network
    with torch.no_grad():  # the value of an observation is its last entry
        for weight in (network.mlp_extractor.critic[0].weight, network.value_net.weight):
            weight.zero_()
        network.mlp_extractor.critic[0].weight[0, 3] = 1.0
        network.value_net.weight[0, 0] = 1.0
        network.mlp_extractor.critic_normalizer.variance.fill_((1.0 - 0.01) ** 2)
    values = torch.tensor([[1.0, 2.0, 3.0]]).repeat(3, 1)
    after = torch.tensor([[2.0, 3.0, 4.0], [2.0, 7.0, 4.0], [2.0, 7.0, 4.0]])
    truncated, terminated = torch.zeros(3, 3, dtype=bool), torch.zeros(3, 3, dtype=bool)
    truncated[1, 1] = terminated[2, 1] = True
    reward = torch.tensor([[1.0, 10.0, 100.0]]).repeat(3, 1)

    def seen(value):
        critic = torch.zeros(3, 3, 4)
        critic[..., 3] = value
        return {"policy": torch.zeros(3, 3, 2), "critic": critic}

    following = {
        **seen(after),
        "reward": reward[..., None],
        "terminated": terminated[..., None],
        "truncated": truncated[..., None],
        "done": (terminated | truncated)[..., None],
    }
    rollout = TensorDict({**seen(values), "next": TensorDict(following, [3, 3])}, [3, 3])
    ppo.advantages.average_gae = False
    with torch.no_grad():
        ppo.advantages(rollout)
    torch.testing.assert_close(rollout["state_value"].squeeze(-1), values)
    last = 100 + 0.9 * 4 - 3
    second = (10 + 0.9 * 3 - 2 + 0.9 * 0.95 * last, 10 + 0.9 * 7 - 2, 10 + 0.0 - 2)
    expected = [[1 + 0.9 * 2 - 1 + 0.9 * 0.95 * step, step, last] for step in second]
    found = rollout["advantage"].squeeze(-1)
    torch.testing.assert_close(found, torch.tensor(expected))
    torch.testing.assert_close(rollout["value_target"].squeeze(-1), found + values)


def test_advantages_are_normalised_over_the_rollout(chase):
    ppo = _ppo()
    rollout = next(_rollouts(ppo, chase, 1))
    with torch.no_grad():
        ppo.advantages(rollout)
    assert abs(rollout["advantage"].mean()) < 1e-5
    assert rollout["advantage"].std() == pytest.approx(1.0, abs=1e-4)


def test_the_first_rollout_only_feeds_the_normalizers(chase):
    ppo = _ppo()
    before, seen = ppo.network.action_net.weight.clone(), []
    for i, rollout in enumerate(_rollouts(ppo, chase, 3)):
        seen.append(rollout["policy"].flatten(0, 1))
        figures = ppo.learn(rollout)
        assert bool(figures) is (i > 0)
        assert torch.equal(before, ppo.network.action_net.weight) is (i == 0)
    normalizer, everything = ppo.network.mlp_extractor.actor_normalizer, torch.cat(seen)
    assert int(normalizer.count) == len(everything) == 3 * 16 * NUM_ENVS
    torch.testing.assert_close(normalizer.mean, everything.mean(0), rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(normalizer.variance, everything.var(0), rtol=1e-2, atol=1e-5)


def test_learning_rate_stays_where_no_divergence_is_desired(chase):
    ppo = _ppo(PPOConfig(hidden=(8,), desired_kl=0.0, rollout_steps=8))
    for rollout in _rollouts(ppo, chase, 3):
        ppo.learn(rollout)
    assert ppo.learning_rate == ppo.optimizer.param_groups[0]["lr"] == 1e-3


def test_a_loss_that_is_not_finite_is_one_clear_error(chase):
    ppo = _ppo()
    rollouts = _rollouts(ppo, chase, 2)
    ppo.learn(next(rollouts))
    rollout = next(rollouts)
    with torch.no_grad():
        ppo.network.value_net.weight.fill_(float("nan"))
    with pytest.raises(OmniEnvsError, match="Training diverged"):
        ppo.learn(rollout)


def test_a_shared_observation_works_too(chase):
    network = TrackingNetwork(2, 2, torch.full((2,), -2.0), torch.full((2,), 2.0), (8,))
    ppo = TensorDictPPO(network, *actor_and_critic(network, ["observation"]), SMALL)
    env = make_torchrl_env(chase(4, False, AutoresetMode.DISABLED))
    collector = Collector(
        env,
        ppo.actor,
        frames_per_batch=64,
        total_frames=128,
        auto_register_policy_transforms=False,
    )
    figures = [ppo.learn(rollout) for rollout in collector]
    collector.shutdown()
    assert figures[1]["kl"] > 0
