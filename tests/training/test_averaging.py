import pytest

torch = pytest.importorskip("torch")

from omni_envs.training.averaging import WeightAverage  # noqa: E402


def _policy(value: float, count: int = 0):
    return {
        "action_net.weight": torch.full((2, 2), value),
        "mlp_extractor.actor_normalizer.count": torch.tensor(count),
        "mlp_extractor.critic.0.weight": torch.ones(2),
        "value_net.bias": torch.ones(1),
    }


def test_the_average_of_constant_weights_is_that_constant():
    average = WeightAverage(7)
    for _ in range(30):
        average.update(_policy(0.3))
    torch.testing.assert_close(
        average.state["weights"]["action_net.weight"], torch.full((2, 2), 0.3)
    )


def test_it_lags_a_ramp_by_what_it_is_over():
    # The stationary lag of an exponential average behind a ramp is (1 - share) / share updates.
    average = WeightAverage(20)
    for i in range(2000):
        average.update(_policy(float(i)))
    assert average.state["weights"]["action_net.weight"][0, 0] == pytest.approx(1999 - 19, abs=0.1)


def test_the_untrained_weights_fade_with_the_first_updates():
    average = WeightAverage(1000)
    average.update(_policy(100.0))
    for _ in range(100):
        average.update(_policy(1.0))
    assert average.state["weights"]["action_net.weight"][0, 0] == pytest.approx(1.0, abs=0.01)


def test_counts_are_the_newest_and_the_critic_is_left_out():
    average = WeightAverage(5)
    for i in range(4):
        average.update(_policy(1.0, count=10 * i))
    weights = average.state["weights"]
    assert set(weights) == {"action_net.weight", "mlp_extractor.actor_normalizer.count"}
    assert weights["mlp_extractor.actor_normalizer.count"] == 30


def test_it_does_not_move_with_the_policy_and_goes_on_from_its_state():
    policy, average = _policy(1.0), WeightAverage(5)
    average.update(policy)
    policy["action_net.weight"].fill_(9.0)
    assert (average.state["weights"]["action_net.weight"] == 1.0).all()
    other = WeightAverage(5, average.state)
    for one in (average, other):
        one.update(_policy(4.0))
    assert average.state["updates"] == other.state["updates"] == 2
    for name, value in average.state["weights"].items():
        assert torch.equal(value, other.state["weights"][name])
