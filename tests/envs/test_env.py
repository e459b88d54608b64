import re
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from omni_envs import registration
from omni_envs.envs import OmniEnv, tables
from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import get_robot

registration.register_all()


@pytest.fixture
def env(reference):
    return OmniEnv(reference=reference)


@pytest.mark.parametrize("entry", registration.ENVIRONMENTS, ids=lambda e: e.id)
def test_gymnasiums_checker_passes(entry):
    robot = get_robot(entry.robot)
    standing = reference_from_qpos(robot, 50.0, np.tile(robot.default_qpos, (30, 1)))
    env = gym.make(entry.id, reference=standing)
    with warnings.catch_warnings():
        # Joint targets and observations have no natural bounds of one.
        warnings.filterwarnings("ignore", message=".*Box.*")
        check_env(env.unwrapped, skip_render_check=True)


def test_it_is_the_vector_environment_with_one_simulation(make, reference):
    env, vector = OmniEnv(reference=reference), make(1, autoreset_mode="DISABLED")
    a, _ = env.reset(seed=5)
    b, _ = vector.reset(seed=5)
    np.testing.assert_array_equal(a, b[0])
    for action in np.random.default_rng(0).normal(size=(10, 29)):
        ours, theirs = env.step(action), vector.step(action[None])
        np.testing.assert_array_equal(ours[0], theirs[0][0])
        assert ours[1:4] == (theirs[1][0], theirs[2][0], theirs[3][0])
        for key, value in ours[4].items():
            assert value == theirs[4][key][0]
            assert isinstance(value, bool | int | float)


def test_attributes_of_the_vector_environment(env):
    assert env.robot.name == "g1"
    assert env.policy_layout.size == 160
    assert env.control_step == pytest.approx(0.02)
    for name in ("nothing", "num_envs", "single_action_space"):  # it is not a vector environment
        with pytest.raises(AttributeError):
            getattr(env, name)


def test_bad_actions(env):
    env.reset(seed=0)
    with pytest.raises(InvalidDataError, match=r"action must be an array \(29,\); got \(3,\)"):
        env.step(np.zeros(3))
    action = np.zeros(29)
    action[4] = np.nan
    with pytest.raises(InvalidDataError, match="action must be real numbers; got dict"):
        env.step({"left_knee": 0.1})
    with pytest.raises(InvalidDataError, match=r"action\[4\] must be finite; got nan"):
        env.step(action)
    assert np.isfinite(env.step(np.zeros(29))[0]).all()


def test_unknown_options_list_the_valid_ones(reference):
    with pytest.raises(InvalidOptionError, match=r"'num_envs'.*Valid: action, anchor"):
        OmniEnv(reference=reference, num_envs=3)
    with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'"):
        OmniEnv(reference=reference, frameskip=3)


def test_a_missing_reference_is_one_clear_error(tmp_path):
    with pytest.raises(ValueError, match=r"nowhere\.npz"):
        OmniEnv(reference=str(tmp_path / "nowhere.npz"))


def test_gym_make_takes_options_and_truncates(reference_file):
    env = gym.make(
        "OmniEnvs/G1BoxCarry-v0",
        reference=reference_file,
        preset="beyondmimic",
        reset={"start": "start", "noise": None},
        termination={"anchor_height": None, "anchor_tilt": None, "end_effector_height": None},
    )
    env.reset(seed=0)
    steps = 0
    while True:
        _, _, terminated, truncated, infos = env.step(np.zeros(29))
        steps += 1
        assert not terminated
        if truncated:
            break
    assert steps == 119
    assert infos["frame"] == 119


def test_figures_of_the_docstring(env):
    """The tables are generated from the code, so they cannot be wrong."""
    text = OmniEnv.__doc__
    for table in (
        tables.action_table,
        tables.observation_table,
        tables.critic_table,
        tables.reward_table,
        tables.termination_table,
        tables.info_table,
    ):
        rows = [re.escape(row.strip()) for row in table().splitlines()]
        assert len(rows) > 5
        assert re.search(r"\s*".join(rows), text), table.__name__


def _column(table: str, index: int = 0) -> list[str]:
    return [row.split("|")[index + 1].strip() for row in table.splitlines()[2:]]


def test_the_table_of_infos_names_every_info(env):
    env.reset(seed=0)
    infos = set(env.step(np.zeros(29))[4])
    documented = set()
    for key in _column(tables.info_table()):
        names = {
            "reward/<term>": _column(tables.reward_table()),
            "terminated/<test>": _column(tables.termination_table())[:4],
        }.get(key, [key])
        documented |= {re.sub("<.*>", "", key) + n if "<" in key else n for n in names}
    assert infos == documented


def test_the_table_of_actions_is_what_actions_do(env):
    table = tables.action_table()
    assert _column(table, 1) == [n.removesuffix("_joint") for n in env.robot.joint_names]
    env = OmniEnv(reference=env.references[0], randomization={"joint_default": 0.0})
    env.reset(seed=0)
    env.step(np.ones(29))
    target = np.array(_column(table, 2), float) + np.array(_column(table, 3), float)
    np.testing.assert_allclose(env.simulation.ctrl[0], target, atol=5e-4)


@pytest.mark.parametrize("privileged", [False, True])
def test_sb3s_checker_passes(reference, privileged):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    env = OmniEnv(reference=reference, observation={"privileged": privileged})
    with warnings.catch_warnings():
        # It would have actions in [-1, 1]; ours are limits far beyond what a policy does.
        warnings.filterwarnings("ignore", message=".*symmetric and normalized.*")
        checker.check_env(env, skip_render_check=True)
