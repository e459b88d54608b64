from dataclasses import replace

import numpy as np
import pytest

from omni_envs.envs import OmniVectorEnv
from omni_envs.references import Reference, reference_from_qpos
from omni_envs.robots import G1
from omni_envs.tracking import make_config
from omni_envs.training.config import TrainConfig
from omni_envs.training.evaluate import evaluate, evaluation_options, play_windows


@pytest.fixture(scope="module")
def standing() -> Reference:
    return reference_from_qpos(G1, 50.0, np.tile(G1.default_qpos, (40, 1)))


def test_options_of_the_task_are_kept_but_for_what_evaluation_fixes():
    task = {
        "preset": "beyondmimic",
        "physics": "fast",
        "observation": {"state_estimation": False},
        "action": {"mode": "residual", "scale": 2.0},
        "reset": {"start": "adaptive", "noise": {"joint_position": 0.2}},
    }
    config = make_config(**evaluation_options(task))
    assert config.physics.timestep == 0.005
    assert not config.observation.state_estimation
    assert config.reset.start == "start" and config.reset.noise.joint_position == 0.2
    assert config.termination.max_seconds is None and config.termination.object_after == 0.0
    assert config.action.mode == "residual" and config.anchor == "torso"
    assert task["observation"] == {"state_estimation": False}


def test_the_randomized_models_are_none_that_training_had(sway):
    options = {"reference": sway(), "randomization": {"variants": 20, "push": None}}
    pools = {}
    for name, some in (
        ("training", options),
        ("evaluation", evaluation_options(options)),
        ("file", evaluation_options(options, file=True)),
    ):
        env = OmniVectorEnv(1, num_threads=1, **some)
        assert env.config.randomization.push is None
        pools[name] = env.simulation._variants.fields["body_mass"][:, -1]
        assert len(set(pools[name])) == 20
        env.close()
    assert not set(pools["training"]) & set(pools["evaluation"])
    np.testing.assert_array_equal(pools["evaluation"], pools["file"])


def test_without_randomization_nothing_is_left_to_chance(standing):
    options = evaluation_options({"reference": standing}, randomized=False)
    returns = []
    for seed in (1, 2):
        env = OmniVectorEnv(2, num_threads=1, **options)
        observation, _ = env.reset(seed=seed)
        total = 0.0
        for _ in range(15):
            observation, reward, *_ = env.step(np.zeros((2, 29)))
            total = total + reward
        returns.append((observation, total))
    np.testing.assert_array_equal(returns[0][0], returns[1][0])
    np.testing.assert_array_equal(returns[0][1], returns[1][1])


def test_a_file_acts_with_standard_actions_that_only_itself_clips():
    config = make_config(
        **evaluation_options({"action": {"mode": "residual", "scale": 2.0}}, file=True)
    )
    assert config.action.mode == "default" and config.action.scale == 2.0
    assert config.action.limit >= 100


def test_windows_are_spread_evenly_over_the_motion(standing):
    options = evaluation_options({"reference": standing}, randomized=False)
    env = OmniVectorEnv(4, num_threads=1, **options)
    seen = []

    def policy(observations, frames):
        seen.append(frames.copy())
        return np.zeros((4, 29))

    windows, seconds = play_windows(env, policy, [40], seconds=0.2)
    assert seconds == pytest.approx(0.2) and (windows.lengths == 10).all()
    # an episode that starts in frame k tracks frame k + 1 first
    np.testing.assert_array_equal(seen[0], np.array([0, 10, 19, 29]) + 1)
    np.testing.assert_array_equal(seen[-1], np.array([0, 10, 19, 29]) + 10)


def test_a_short_motion_is_one_window(standing):
    env = OmniVectorEnv(
        2, num_threads=1, **evaluation_options({"reference": standing}, randomized=False)
    )
    windows, seconds = play_windows(env, lambda o, f: np.zeros((2, 29)), [40], seconds=3.0)
    assert seconds == pytest.approx(39 * 0.02)
    assert (windows.lengths <= 39).all()


def test_every_motion_is_evaluated_by_itself(sway, tmp_path):
    short = str(sway(30).save(tmp_path / "short.npz"))
    falls = sway(60)  # moved up beyond the height that ends an episode: nobody can follow
    falls.qpos[30:, 2] += 0.5
    long = str(
        reference_from_qpos(G1, 50.0, falls.qpos, falls.object_poses, falls.scene).save(
            tmp_path / "long.npz"
        )
    )
    config = TrainConfig(
        "OmniEnvs/G1BoxCarry-v0",
        tmp_path,
        1,
        num_threads=1,
        evaluation_episodes=7,
        env_options={"reference": [short, long], "action": {"mode": "feedforward"}},
    )
    starts = []

    def still(observations, frames):
        starts.append(frames)
        return np.zeros((len(frames), 29))

    found = evaluate(config, still)
    one, two = found.motions
    assert (one.motion, one.episodes, one.episode_length_possible) == (0, 4, 29)
    assert (two.motion, two.episodes, two.episode_length_possible) == (1, 3, 59)
    assert two.success_rate == 0.0 and two.episode_length_mean < 35
    assert found.success_rate == pytest.approx(4 * one.success_rate / 7)
    assert found.episode_length_mean == pytest.approx(
        (4 * one.episode_length_mean + 3 * two.episode_length_mean) / 7
    )
    windows = next(frames for frames in starts if len(frames) == 64)
    np.testing.assert_array_equal(windows[::2], 1)  # 29 control steps: one window
    assert windows[1::2].min() == 1 and windows[1::2].max() == 31
    assert "motions" in found.figures()
    assert "motions" not in replace(found, motions=()).figures()
