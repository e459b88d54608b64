import numpy as np
import pytest
from gymnasium import spaces

pytest.importorskip("torchrl")
import torch
from tensordict import TensorDict
from torchrl.envs.utils import ExplorationType, set_exploration_type

from omni_envs.errors import InvalidDataError
from omni_envs.training.network import Actor
from omni_envs.training.torchrl_network import TrackingNetwork, actor_and_critic, observation_keys

LOW, HIGH = -torch.ones(3), torch.full((3,), 2.0)


@pytest.fixture
def network():
    torch.manual_seed(0)
    network = TrackingNetwork(5, 7, LOW, HIGH, hidden=(8, 6), initial_std=0.3)
    network.mlp_extractor.update_normalizers(
        {"policy": torch.randn(50, 5) + 2, "critic": 3 * torch.randn(50, 7)}
    )
    return network


@pytest.fixture
def sb3(network):
    """SB3's policy with the same weights."""
    pytest.importorskip("stable_baselines3")
    from omni_envs.training.policy import TrackingPolicy

    def box(size):
        return spaces.Box(-np.inf, np.inf, (size,), np.float32)

    policy = TrackingPolicy(
        spaces.Dict(policy=box(5), critic=box(7)),
        spaces.Box(LOW.numpy(), HIGH.numpy(), dtype=np.float32),
        lambda _: 1e-3,
        hidden=(8, 6),
        initial_std=0.3,
    )
    policy.load_state_dict(network.state_dict())
    return policy


def _observations(count: int = 40) -> TensorDict:
    return TensorDict({"policy": torch.randn(count, 5), "critic": torch.randn(count, 7)}, [count])


def test_weights_are_those_of_the_sb3_policy_in_the_same_order(network, sb3):
    ours = [(name, p.shape) for name, p in network.named_parameters()]
    assert ours == [(name, p.shape) for name, p in sb3.named_parameters()]
    assert list(network.state_dict()) == list(sb3.state_dict())


def test_same_weights_same_actions_and_values(network, sb3):
    actor, critic = actor_and_critic(network, ("policy", "critic"))
    seen = _observations()
    taken = critic(actor(seen.clone()))
    values, log_probability, _ = sb3.evaluate_actions(seen.to_dict(), taken["action"])
    torch.testing.assert_close(taken["state_value"], values)
    torch.testing.assert_close(taken["action_log_prob"], log_probability)
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        best = actor(seen.clone())["action"]
    expected, _ = sb3.predict({k: v.numpy() for k, v in seen.items()}, deterministic=True)
    np.testing.assert_allclose(best.detach().clamp(LOW, HIGH), expected, atol=1e-6)


def test_the_deterministic_actor_is_rebuilt_from_the_weights(network):
    actor, _ = actor_and_critic(network, ("policy", "critic"))
    seen = _observations()
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        mean = actor(seen)["action"]
    rebuilt = Actor.from_weights(network.state_dict())
    torch.testing.assert_close(rebuilt(seen["policy"]), mean.clamp(LOW, HIGH))


def test_first_actions_are_small_and_as_noisy_as_asked(network):
    actor, _ = actor_and_critic(network, ("policy", "critic"))
    taken = actor(_observations(4000))
    assert taken["loc"].abs().max() < 0.1
    assert taken["action"].std(dim=0).tolist() == pytest.approx([0.3] * 3, rel=0.05)


def test_actor_and_critic_may_see_the_same():
    network = TrackingNetwork(4, 4, LOW, HIGH, hidden=(8,))
    actor, critic = actor_and_critic(network, ["observation", "step_count"])
    taken = critic(actor(TensorDict({"observation": torch.randn(2, 4)}, [2])))
    assert taken["action"].shape == (2, 3) and taken["state_value"].shape == (2, 1)


def test_other_observations_are_one_clear_error():
    with pytest.raises(InvalidDataError, match=r"'policy' and 'critic'.*pixels"):
        observation_keys(["pixels"])
