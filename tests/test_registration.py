from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

from omni_envs import registration
from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import get_robot, robot_names
from omni_envs.tracking import PhysicsConfig, ResetConfig

registration.register_all()


@pytest.fixture(scope="module")
def reference_files(tmp_path_factory):
    """Robot to a file in which it stands."""
    folder = tmp_path_factory.mktemp("reference")
    files = {}
    for name in ("g1", "h1", "t1"):
        robot = get_robot(name)
        reference = reference_from_qpos(robot, 50.0, np.tile(robot.default_qpos, (30, 1)))
        files[name] = str(reference.save(folder / f"{name}.npz"))
    return files


@pytest.fixture
def reference_file(reference_files):
    return reference_files["g1"]


def test_ids():
    tasks = ("BoxCarry", "Climb", "Crawl", "Track")
    assert [e.id for e in registration.ENVIRONMENTS] == [
        f"OmniEnvs/{robot}{task}-v0" for robot in ("G1", "H1", "T1") for task in tasks
    ]
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
def test_a_spec_with_options_survives_json(entry, reference_files):
    env = gym.make(
        entry.id,
        reference=reference_files[entry.robot],
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


def test_a_spec_with_dataclasses_survives_json(reference_file):
    env = gym.make(
        "OmniEnvs/G1Track-v0",
        reference=reference_file,
        reset=ResetConfig(noise=None),
        physics=PhysicsConfig(timestep=0.01, substeps=2),
    )
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config


def _survives_json(make, env_id, reference, kept):
    env = make(env_id, reference=reference)
    assert env.spec.kwargs["reference"] == kept
    again = make(EnvSpec.from_json(env.spec.to_json()))
    assert again.spec.to_json() == env.spec.to_json()
    assert len(again.unwrapped.references) == (1 if isinstance(kept, str) else len(kept))
    np.testing.assert_array_equal(again.reset(seed=0)[0], env.reset(seed=0)[0])


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
@pytest.mark.parametrize("entry", registration.ENVIRONMENTS, ids=lambda e: e.id)
def test_a_path_in_a_spec_survives_json(entry, reference_files, make):
    text = reference_files[entry.robot]
    _survives_json(make, entry.id, Path(text), text)


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
def test_a_reference_in_a_spec_may_be_a_text_or_a_list(reference_file, make):
    text, path = reference_file, Path(reference_file)
    for reference, kept in ((text, text), ([path, text], [text, text]), ((path,), [text])):
        _survives_json(make, "OmniEnvs/G1BoxCarry-v0", reference, kept)


@pytest.mark.parametrize("entry", registration.ENVIRONMENTS, ids=lambda e: e.id)
def test_a_spec_without_options_survives_json(entry):
    spec = gym.spec(entry.id)
    assert EnvSpec.from_json(spec.to_json()) == spec


@pytest.mark.parametrize("mode", ["DISABLED", AutoresetMode.DISABLED])
def test_a_spec_of_a_vector_environment_survives_json(reference_file, mode):
    env = gym.make_vec(
        "OmniEnvs/G1Track-v0",
        num_envs=2,
        reference=reference_file,
        autoreset_mode=mode,
        physics="fast",
    )
    again = gym.make_vec(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config
    assert again.num_envs == 2
    assert again.metadata["autoreset_mode"] is AutoresetMode.DISABLED


def test_make_vec_uses_the_native_vector_environment(reference_file):
    env = gym.make_vec("OmniEnvs/G1BoxCarry-v0", num_envs=3, reference=reference_file)
    assert type(env.unwrapped).__name__ == "OmniVectorEnv"
    assert env.num_envs == 3
    assert env.reset(seed=0)[0].shape == (3, 160)


def test_unknown_id():
    with pytest.raises(gym.error.NameNotFound):
        gym.make("OmniEnvs/G1Juggle-v0")
    from omni_envs.benchmarks.step import bench_step

    with pytest.raises(UnknownNameError, match="Valid: OmniEnvs/G1BoxCarry-v0, OmniEnvs/G1Cl"):
        bench_step("OmniEnvs/G1Juggle-v0")


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
def test_unknown_option_of_make_lists_the_valid_ones(make):
    with pytest.raises(InvalidOptionError, match=r"'rewrd'.*Did you mean 'reward'.*randomization"):
        make("OmniEnvs/G1BoxCarry-v0", rewrd={})
