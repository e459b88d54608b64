import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from omni_envs.errors import InvalidOptionError
from omni_envs.training.policy import TrackingPolicy
from omni_envs.training.sb3_vec_env import SB3VecEnv


@pytest.mark.parametrize("privileged", [False, True])
def test_terminal_observation_is_the_last_of_the_old_episode(chase, privileged):
    inner = chase(4, privileged)
    env = SB3VecEnv(inner)
    env.seed(3)
    env.reset()
    actions = np.zeros((4, 2), np.float32)
    actions[0] = 2.0  # runs out of bounds; the others stand still until they are truncated
    seen = dict.fromkeys(range(4), 0)
    for _ in range(20):
        before = inner.position.copy()
        observation, _, done, infos = env.step(actions)
        for i in np.flatnonzero(done):
            last = infos[i]["terminal_observation"]
            last = last["policy"] if privileged else last
            now = observation["policy"][i] if privileged else observation[i]
            np.testing.assert_allclose(last, (before + 0.1 * actions)[i] * 5 + 3, rtol=1e-5)
            assert not np.allclose(last, now)
            assert infos[i]["TimeLimit.truncated"] is bool(i != 0)
            assert infos[i]["error/body_position"] == pytest.approx(
                np.linalg.norm((before + 0.1 * actions)[i])
            )
            seen[i] += 1
        for i in np.flatnonzero(~done):
            assert infos[i] == {}
    assert seen[0] >= 1 and seen[1] == seen[2] == seen[3] == 1


def test_seed_makes_resets_repeat(chase):
    first, second = SB3VecEnv(chase(4)), SB3VecEnv(chase(4))
    for env in (first, second):
        env.seed(11)
    np.testing.assert_array_equal(first.reset()["policy"], second.reset()["policy"])
    assert not np.array_equal(first.reset()["policy"], SB3VecEnv(chase(4)).reset()["policy"])


def test_vec_monitor_counts_episodes(chase):
    env = VecMonitor(SB3VecEnv(chase(4)))
    env.reset()
    lengths = []
    for _ in range(40):
        _, _, _, infos = env.step(np.zeros((4, 2), np.float32))
        lengths += [info["episode"]["l"] for info in infos if "episode" in info]
    assert lengths == [20] * 8


def test_plain_sb3_algorithms_train_on_it(chase):
    flat = PPO("MlpPolicy", SB3VecEnv(chase(4, privileged=False)), n_steps=8, batch_size=16)
    flat.learn(64)
    both = PPO(
        TrackingPolicy,
        SB3VecEnv(chase(4)),
        n_steps=8,
        batch_size=16,
        policy_kwargs={"hidden": (8,)},
    )
    both.learn(64)
    assert flat.num_timesteps == both.num_timesteps == 64


def test_other_autoreset_modes_are_refused(chase):
    env = chase(2)
    env.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}
    with pytest.raises(InvalidOptionError, match=r"SAME_STEP.*NEXT_STEP"):
        SB3VecEnv(env)
