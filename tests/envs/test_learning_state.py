import json

import numpy as np
import pytest

from omni_envs.errors import InvalidDataError

LEARNS = {
    "reset": {"start": "adaptive", "growth": {"share": 0.0, "step": 0.15, "observation": True}},
    "termination": {"object_after": 0.01},
    "max_episode_steps": 12,
}
ACTIONS = np.random.default_rng(0).normal(size=(460, 8, 29)) * 5


@pytest.fixture
def taught(make):
    env = make(8, **LEARNS)
    env.reset(seed=0)
    for actions in ACTIONS:
        env.step(actions)
    return env


def test_the_state_goes_through_json_into_another_environment(make, taught):
    state = json.loads(json.dumps(taught.learning_state()))
    assert max(state["failures"]) > 0 and state["gate"]["open"]
    level = taught.noise_level
    assert 0.3 <= level < 1.0 and state["noise"]["level"] == level
    assert 0 < state["noise"]["episodes"] < 100
    other = make(8, **LEARNS)
    other.reset(seed=5)
    assert other.learning_state() != state
    other.restore_learning_state(state)
    assert other.learning_state() == state == taught.learning_state()
    assert other.noise_level == level and other.object_test_active
    np.testing.assert_array_equal(other.sampler.probabilities(), taught.sampler.probabilities())


def test_both_go_on_alike(make, taught):
    other = make(8, **LEARNS)
    other.reset(seed=1)
    taught_state = taught.learning_state()
    taught.reset(seed=1)  # forgets
    for env in (taught, other):
        env.restore_learning_state(taught_state)
        env.reset()
    for actions in ACTIONS[:40]:
        for one, two in zip(taught.step(actions)[:4], other.step(actions)[:4], strict=True):
            np.testing.assert_array_equal(one, two)
    assert taught.learning_state() == other.learning_state() != taught_state


def test_what_is_restored_is_the_next_draw(make, taught):
    """The sampler keeps a running sum of its bins: an old one must not survive."""
    env = make(8, **LEARNS)
    env.reset(seed=0)
    state = env.learning_state()
    bins = len(state["failures"])
    env.restore_learning_state({**state, "failures": [*[0.0] * (bins - 1), 1e6]})
    _, infos = env.reset()
    assert (infos["frame"] > 119 * (bins - 1) / bins).all()


def test_a_seeded_reset_forgets(make, taught):
    fresh = make(8, **LEARNS).learning_state()
    taught.reset()
    assert taught.learning_state() != fresh
    taught.reset(seed=3)
    assert taught.learning_state() == fresh


def test_noise_that_does_not_grow_and_a_gate_that_is_open_stay_so(make, taught):
    env = make(8, termination={"object_after": 0.0})
    env.restore_learning_state({**taught.learning_state(), "gate": {"open": False, "recent": []}})
    assert env.noise_level == 1.0 and env.object_test_active


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"failures": [0.0]}, "failures must be of 3 bins"),
        ({"failures": [0.0, -1.0, 0.0]}, "failures must be finite and not negative"),
        ({"failures": [0.0, float("nan"), 0.0]}, "failures must be finite"),
        ({"failures": "many"}, "failures must be numbers"),
        ({"gate": {"open": True}}, r"gate must be a mapping of \['open', 'recent'\]"),
        ({"noise": 0.5}, "noise must be a mapping"),
        ({"noise": {"level": 2.0, "episodes": 0, "lasted": 0, "possible": 0}}, r"in \[0, 1\]"),
        ({"nois": {}}, "fields must be a mapping"),
    ],
)
def test_a_state_of_another_environment_is_one_clear_error(make, taught, change, message):
    before = taught.learning_state()
    with pytest.raises(InvalidDataError, match="Learning state: .*" + message):
        taught.restore_learning_state({**before, **change})
    assert taught.learning_state() == before
