from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor

from omni_envs.errors import OmniEnvsError
from omni_envs.training.config import PPOConfig
from omni_envs.training.learning_rate import MAX_LEARNING_RATE
from omni_envs.training.ppo import TrackingPPO, _gaussian_kl, _value_loss
from omni_envs.training.sb3_vec_env import SB3VecEnv

SMALL = PPOConfig(rollout_steps=16, epochs=4, minibatches=2, hidden=(32, 32), gamma=0.9)


def _learner(chase, config: PPOConfig = SMALL, num_envs: int = 32, seed: int = 0) -> TrackingPPO:
    return TrackingPPO(VecMonitor(SB3VecEnv(chase(num_envs))), config, seed=seed)


class _Everything(BaseCallback):
    """Keeps every observation the policy saw."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[np.ndarray] = []

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        self.seen.append(self.model.rollout_buffer.observations["policy"].reshape(-1, 2).copy())


def test_learns(chase):
    learner = _learner(chase)
    learner.learn(1)
    first = np.mean([e["r"] for e in learner.ep_info_buffer])
    learner.learn(40 * 16 * 32, reset_num_timesteps=False)
    last = np.mean([e["r"] for e in list(learner.ep_info_buffer)[-32:]])
    assert last > first + 4.0  # the most that 20 steps can give is 20


def test_normalizer_holds_the_statistics_of_everything_seen(chase):
    learner, everything = _learner(chase), _Everything()
    learner.learn(3 * 16 * 32, callback=everything)
    seen = np.concatenate(everything.seen)
    normalizer = learner.policy.mlp_extractor.actor_normalizer
    assert int(normalizer.count) == len(seen) == 3 * 16 * 32
    np.testing.assert_allclose(normalizer.mean, seen.mean(0), rtol=1e-4)
    np.testing.assert_allclose(normalizer.variance, seen.var(0), rtol=1e-3)


def test_the_first_rollout_only_feeds_the_normalizer(chase):
    learner = _learner(chase)
    before = learner.policy.action_net.weight.clone()
    learner.learn(1)
    assert torch.equal(before, learner.policy.action_net.weight)
    learner.learn(1, reset_num_timesteps=False)
    assert not torch.equal(before, learner.policy.action_net.weight)


def test_a_rollout_is_on_policy_at_its_update(chase):
    learner = _learner(chase)
    learner.learn(2 * 16 * 32)
    learner._setup_learn(10**6, None, False)
    learner.collect_rollouts(learner.env, _started(learner), learner.rollout_buffer, 16)
    rollout = learner._rollout()
    with torch.no_grad():
        values, log_probability, _ = learner.policy.evaluate_actions(
            rollout.observations, rollout.actions
        )
    torch.testing.assert_close(log_probability, rollout.log_probability, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(values.flatten(), rollout.values, atol=1e-4, rtol=1e-4)
    assert abs(rollout.advantages.mean()) < 1e-5
    assert rollout.advantages.std() == pytest.approx(1.0, abs=1e-4)


def _started(learner: TrackingPPO) -> BaseCallback:
    callback = _Everything()
    callback.init_callback(learner)
    return callback


def test_minibatches_hold_every_sample_once(chase):
    learner = _learner(chase)
    learner.learn(1)
    rollout = learner._rollout()
    rollout.returns = torch.arange(16 * 32)
    parts = list(rollout.minibatches(3))
    assert sorted(torch.cat([part.returns for part in parts]).tolist()) == list(range(16 * 32))
    for part in parts:
        assert torch.equal(part.actions, rollout.actions[part.returns])
        assert torch.equal(
            part.observations["critic"], rollout.observations["critic"][part.returns]
        )


@pytest.mark.parametrize(("kl", "factor"), [(0.03, 1 / 1.5), (0.001, 1.5), (0.01, 1.0)])
def test_learning_rate_follows_the_divergence(chase, kl, factor):
    learner = _learner(chase)
    learner._adapt_learning_rate(kl)
    assert learner.current_learning_rate == pytest.approx(1e-3 * factor)
    assert learner.policy.optimizer.param_groups[0]["lr"] == learner.current_learning_rate


@pytest.mark.parametrize(("every", "count"), [("minibatch", 8), ("update", 1)])
def test_learning_rate_is_adapted_as_often_as_asked(chase, monkeypatch, every, count):
    learner = _learner(chase, replace(SMALL, epochs=2, minibatches=4, adapt_every=every))
    learner.learn(1)  # feeds the normalisers only
    seen = []
    monkeypatch.setattr(learner, "_adapt_learning_rate", seen.append)
    learner.learn(1, reset_num_timesteps=False)
    assert len(seen) == count
    if every == "update":  # the divergence of the last epoch is more than the mean one
        assert seen[0] > learner.figures["kl"] > 0


def test_the_critic_may_have_a_learning_rate_of_its_own(chase):
    learner = _learner(chase, replace(SMALL, critic_learning_rate=2e-3))
    actor, critic = learner.policy.optimizer.param_groups
    assert len(actor["params"]) + len(critic["params"]) == len(list(learner.policy.parameters()))
    learner.learn(1)
    before = {k: v.clone() for k, v in learner.policy.named_parameters()}
    learner._adapt_learning_rate(1.0)
    assert (actor["lr"], critic["lr"]) == (learner.current_learning_rate, 2e-3)
    learner.config = replace(learner.config, desired_kl=0.0)  # keeps the rates as they are
    actor["lr"] = learner.current_learning_rate = 0.0
    learner.learn(1, reset_num_timesteps=False)
    moved = {k for k, v in learner.policy.named_parameters() if not torch.equal(v, before[k])}
    assert moved and all("critic" in k or "value_net" in k for k in moved)


def test_learning_rate_stays_within_its_limits(chase):
    learner = _learner(chase)
    for _ in range(50):
        learner._adapt_learning_rate(1e-6)
    assert learner.current_learning_rate == MAX_LEARNING_RATE


def test_divergence_is_that_of_torch():
    one = torch.distributions.Normal(torch.randn(9, 3), torch.rand(9, 3) + 0.1)
    two = torch.distributions.Normal(torch.randn(9, 3), torch.rand(9, 3) + 0.1)
    expected = torch.distributions.kl_divergence(one, two).sum(-1).mean()
    found = _gaussian_kl(one.mean, one.stddev, two.mean, two.stddev)
    assert float(found) == pytest.approx(float(expected), rel=1e-5)


def test_clipped_value_loss_is_the_larger_one():
    values, returns = torch.tensor([0.5, -0.5, 0.1]), torch.tensor([1.0, 1.0, 0.1])
    # moved too far towards the return: clipped; away from it: plain; within the range: plain
    loss = _value_loss(values, torch.zeros(3), returns, clip=0.2)
    assert float(loss) == pytest.approx((0.8**2 + 1.5**2 + 0.0) / 3)
    plain = _value_loss(values, torch.zeros(3), returns, clip=0.0)
    assert float(plain) == pytest.approx((0.5**2 + 1.5**2 + 0.0) / 3)


def test_two_threads_give_the_gradient_of_the_sum(chase):
    learner = _learner(chase, replace(SMALL, action_weight=0.1))
    learner.learn(1)
    batch = learner._rollout()
    learner._actor_backward(batch)
    learner._critic_backward(batch)
    found = [p.grad.clone() for p in learner.policy.parameters()]
    learner.policy.optimizer.zero_grad()
    values, log_probability, entropy = learner.policy.evaluate_actions(
        batch.observations, batch.actions
    )
    ratio = torch.exp(log_probability - batch.log_probability)
    mean = learner.policy.get_distribution(batch.observations).distribution.mean
    loss = -(ratio * batch.advantages).mean() - 0.005 * entropy.mean()
    loss += 0.1 * mean.norm(dim=-1).square().mean()
    loss += _value_loss(values.flatten(), batch.values, batch.returns, 0.2)
    loss.backward()
    for one, parameter in zip(found, learner.policy.parameters(), strict=True):
        torch.testing.assert_close(one, parameter.grad, rtol=1e-4, atol=1e-6)


def test_a_loss_that_is_not_finite_is_one_clear_error(chase):
    learner = _learner(chase)
    learner.learn(1)
    with torch.no_grad():
        learner.policy.value_net.weight.fill_(float("nan"))
    with pytest.raises(OmniEnvsError, match=r"Training diverged after \d+ steps"):
        learner.learn(1, reset_num_timesteps=False)


@pytest.mark.parametrize("every", ["update", "minibatch"])
def test_a_policy_that_is_not_finite_is_one_clear_error(chase, monkeypatch, every):
    # As where TorchRL, which switches this off, is not installed.
    monkeypatch.setattr(torch.distributions.Distribution, "_validate_args", True)
    fast = replace(SMALL, learning_rate=1e38, desired_kl=0.0, max_grad_norm=1e30)
    with pytest.raises(OmniEnvsError, match=r"Training diverged after \d+ steps"):
        _learner(chase, replace(fast, adapt_every=every)).learn(3 * 16 * 32)


def test_same_seed_same_weights(chase):
    weights = []
    for _ in range(2):
        learner = _learner(chase, seed=5)
        learner.learn(3 * 16 * 32)
        weights.append(learner.policy.action_net.weight.clone())
    assert torch.equal(*weights)


@pytest.mark.parametrize("critic", [0.0, 2e-3])
def test_sb3s_save_and_load(chase, tmp_path, critic):
    learner = _learner(chase, replace(SMALL, critic_learning_rate=critic))
    learner.learn(3 * 16 * 32)
    learner.save(tmp_path / "model.zip")
    seen = {"policy": np.ones((5, 2), np.float32), "critic": np.ones((5, 4), np.float32)}
    expected, _ = learner.predict(seen, deterministic=True)
    alone = TrackingPPO.load(tmp_path / "model.zip")
    np.testing.assert_array_equal(alone.predict(seen, deterministic=True)[0], expected)
    again = TrackingPPO.load(tmp_path / "model.zip", env=learner.get_env())
    assert again.config == learner.config
    assert again.current_learning_rate == learner.current_learning_rate
    groups = [group["lr"] for group in again.policy.optimizer.param_groups]
    assert groups == [group["lr"] for group in learner.policy.optimizer.param_groups]
    again.learn(2 * 16 * 32)
    assert again.figures["kl"] > 0
    assert not np.array_equal(again.predict(seen, deterministic=True)[0], expected)
