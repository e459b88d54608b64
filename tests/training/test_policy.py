import numpy as np
import pytest
from gymnasium import spaces

pytest.importorskip("stable_baselines3")
import torch

from omni_envs.errors import InvalidDataError
from omni_envs.training.network import Actor
from omni_envs.training.policy import TrackingPolicy

ACTIONS = spaces.Box(-0.5, 0.5, (3,), np.float32)


def _box(size: int) -> spaces.Box:
    return spaces.Box(-np.inf, np.inf, (size,), np.float32)


def _policy(space: spaces.Space) -> TrackingPolicy:
    torch.manual_seed(0)
    return TrackingPolicy(space, ACTIONS, lambda _: 1e-3, hidden=(16, 8), initial_std=0.4)


def test_actor_does_not_see_what_the_critic_sees():
    policy = _policy(spaces.Dict({"policy": _box(4), "critic": _box(7)}))
    seen = {"policy": torch.randn(5, 4), "critic": torch.randn(5, 7)}
    other = {**seen, "critic": torch.randn(5, 7)}
    assert torch.equal(
        policy.get_distribution(seen).distribution.mean,
        policy.get_distribution(other).distribution.mean,
    )
    assert not torch.equal(policy.predict_values(seen), policy.predict_values(other))
    same_values = {**other, "policy": torch.randn(5, 4)}
    assert torch.equal(policy.predict_values(other), policy.predict_values(same_values))


def test_a_flat_observation_feeds_both():
    policy = _policy(_box(4))
    x = torch.randn(2, 4)
    assert policy.get_distribution(x).distribution.mean.shape == (2, 3)
    assert policy.predict_values(x).shape == (2, 1)


def test_deviation_starts_as_asked_and_does_not_depend_on_the_state():
    policy = _policy(_box(4))
    std = policy.get_distribution(torch.randn(6, 4)).distribution.stddev
    assert torch.allclose(std, torch.full((6, 3), 0.4))


def test_actor_is_what_predict_returns_clipping_included():
    policy = _policy(_box(4))
    policy.mlp_extractor.update_normalizers(torch.randn(64, 4) * 4 + 2)
    torch.nn.init.normal_(policy.action_net.weight, std=0.5)
    x = np.random.default_rng(0).normal(size=(32, 4)).astype(np.float32)
    expected, _ = policy.predict(x, deterministic=True)
    with torch.no_grad():
        actions = policy.actor()(torch.from_numpy(x)).numpy()
    np.testing.assert_array_equal(actions, expected)
    assert (np.abs(actions) == 0.5).any() and (np.abs(actions) < 0.5).any()


@pytest.mark.parametrize(
    "space",
    [
        spaces.Discrete(3),
        spaces.Dict({"policy": _box(3), "other": _box(3)}),
        spaces.Box(0.0, 1.0, (2, 2), np.float32),
    ],
)
def test_other_observation_spaces_are_refused(space):
    with pytest.raises(InvalidDataError, match=r"observation_space.*'policy' and 'critic'"):
        _policy(space)


def test_actor_is_rebuilt_from_saved_weights():
    policy = _policy(spaces.Dict({"policy": _box(4), "critic": _box(7)}))
    seen = {"policy": torch.randn(64, 4), "critic": torch.randn(64, 7)}
    policy.mlp_extractor.update_normalizers(seen)
    rebuilt = Actor.from_weights(policy.state_dict())
    assert torch.equal(rebuilt(seen["policy"]), policy.actor()(seen["policy"]))
