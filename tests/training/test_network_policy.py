import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.training.checkpoint import Checkpoint
from omni_envs.training.config import PPOConfig, TrainConfig
from omni_envs.training.network_policy import NetworkPolicy, find_checkpoint, load_actor
from omni_envs.training.run import train


@pytest.fixture
def run(chase, tmp_path):
    ppo = PPOConfig(rollout_steps=4, epochs=1, minibatches=1, hidden=(8,))
    train(TrainConfig("Chase", tmp_path, 3 * 32, num_envs=8, ppo=ppo), env=chase(8))
    return tmp_path


def test_first_is_untrained_and_last_is_trained(run):
    first, last = find_checkpoint(run, "first"), find_checkpoint(run)
    assert Checkpoint.load(first).steps == 0 and Checkpoint.load(last).steps == 96
    observations = np.ones((5, 2), np.float32)
    one = NetworkPolicy(load_actor(first))(observations, np.zeros(5))
    two = NetworkPolicy(load_actor(last))(observations, np.zeros(5))
    assert one.shape == two.shape == (5, 2) and not np.allclose(one, two)


def test_observations_of_another_size_are_refused(run):
    policy = NetworkPolicy(load_actor(find_checkpoint(run)))
    with pytest.raises(InvalidDataError, match=r"\(N, 2\); got \(5, 3\)"):
        policy(np.ones((5, 3), np.float32), np.zeros(5))


def test_a_folder_without_checkpoints_is_one_clear_error(tmp_path):
    with pytest.raises(FileFormatError, match="checkpoints of a run; found none"):
        find_checkpoint(tmp_path)


def test_a_checkpoint_of_another_network_is_one_clear_error(tmp_path):
    other = Checkpoint(1, 0.0, 0, 0.0, {"weight": torch.zeros(2)}, {}, torch.get_rng_state())
    with pytest.raises(FileFormatError, match="weights of a TrackingPolicy"):
        load_actor(other.save(tmp_path))
