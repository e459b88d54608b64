import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from omni_envs import registration
from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1, robot_names

registration.register_all()


@pytest.fixture(scope="module")
def reference_file(tmp_path_factory):
    qpos = np.tile(G1.default_qpos, (30, 1))
    path = tmp_path_factory.mktemp("reference") / "stand.npz"
    return str(reference_from_qpos(G1, 50.0, qpos).save(path))


def test_ids():
    assert [e.id for e in registration.ENVIRONMENTS] == ["OmniEnvs/G1BoxCarry-v0"]
    for entry in registration.ENVIRONMENTS:
        assert entry.robot in robot_names()
        spec = gym.spec(entry.id)
        assert spec.kwargs == {"robot": entry.robot, "task": entry.task}
        assert spec.entry_point
        assert spec.vector_entry_point


def test_registering_twice_changes_nothing():
    before = dict(gym.registry)
    registration.register_all()
    assert gym.registry == before


@pytest.mark.parametrize("entry", registration.ENVIRONMENTS, ids=lambda e: e.id)
def test_a_spec_with_options_survives_json(entry, reference_file):
    env = gym.make(
        entry.id,
        reference=reference_file,
        preset="beyondmimic",
        reward={"body_position": {"weight": 2.0}},
        randomization={"push": {"interval": [2, 4]}},
        reset={"noise": None},
    )
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config
    assert again.unwrapped.config.randomization.push.interval == (2.0, 4.0)
    a, b = env.reset(seed=1)[0], again.reset(seed=1)[0]
    np.testing.assert_array_equal(a, b)


def test_make_vec_uses_the_native_vector_environment(reference_file):
    env = gym.make_vec("OmniEnvs/G1BoxCarry-v0", num_envs=3, reference=reference_file)
    assert type(env.unwrapped).__name__ == "OmniVectorEnv"
    assert env.num_envs == 3
    assert env.reset(seed=0)[0].shape == (3, 160)


def test_unknown_id():
    with pytest.raises(gym.error.NameNotFound):
        gym.make("OmniEnvs/G1Juggle-v0")
    from omni_envs.benchmarks.step import bench_step

    with pytest.raises(UnknownNameError, match="Valid: OmniEnvs/G1BoxCarry-v0"):
        bench_step("OmniEnvs/G1Juggle-v0")


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
def test_unknown_option_of_make_lists_the_valid_ones(make):
    with pytest.raises(InvalidOptionError, match=r"'rewrd'.*Did you mean 'reward'.*randomization"):
        make("OmniEnvs/G1BoxCarry-v0", rewrd={})
