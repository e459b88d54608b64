"""TorchRL's collectors on our environment: in this process, in two more, and on Ray."""

from functools import partial

import pytest

pytest.importorskip("torchrl")
import torch
from torchrl.collectors import Collector, MultiSyncCollector

from omni_envs.threads import one_maths_thread
from omni_envs.training.config import PPOConfig
from omni_envs.training.torchrl_env import make_torchrl_env
from omni_envs.training.torchrl_network import TrackingNetwork, actor_and_critic
from omni_envs.training.torchrl_ppo import TensorDictPPO

NUM_ENVS, STEPS, ROLLOUTS = 2, 6, 3
CONFIG = PPOConfig(rollout_steps=STEPS, epochs=1, minibatches=2, hidden=(8,))


@pytest.fixture(scope="module")
def make(sway, tmp_path_factory):
    """Makes the environment; can be sent to another process."""
    path = sway().save(tmp_path_factory.mktemp("references") / "sway.npz")
    return partial(
        make_torchrl_env,
        "OmniEnvs/G1BoxCarry-v0",
        NUM_ENVS,
        num_threads=1,
        reference=str(path),
        observation={"privileged": True},
    )


@pytest.fixture
def ppo():
    torch.manual_seed(0)
    network = TrackingNetwork(160, 298, torch.full((29,), -10.0), torch.full((29,), 10.0), (8,))
    return TensorDictPPO(network, *actor_and_critic(network, ("policy", "critic")), CONFIG)


def _always(ppo: TensorDictPPO, action: float) -> None:
    """Makes a policy that says which weights it has."""
    with torch.no_grad():
        ppo.network.action_net.weight.zero_()
        ppo.network.action_net.bias.fill_(action)
        ppo.network.log_std.fill_(-20.0)


def _train(ppo: TensorDictPPO, collector, num_envs: int) -> None:
    """PPO on what a collector yields; every rollout comes from the weights it was given last."""
    _always(ppo, 0.0)
    collector.update_policy_weights_()
    count = 0
    for batch in collector:
        rollout = batch.reshape(-1, STEPS)  # some collectors give each worker a row
        assert rollout.batch_size == (num_envs, STEPS)
        assert len(torch.unique(rollout["policy"][:, 0], dim=0)) == num_envs  # seeds differ
        expected = torch.full_like(rollout["action"], 0.1 * count)
        torch.testing.assert_close(rollout["action"], expected, atol=1e-5, rtol=0)
        going = ~rollout["next", "done"][:, :-1].squeeze(-1)
        assert torch.equal(
            rollout["next", "policy"][:, :-1][going], rollout["policy"][:, 1:][going]
        )
        assert bool(ppo.learn(batch)) is (count > 0)
        count += 1
        _always(ppo, 0.1 * count)
        collector.update_policy_weights_()
    assert count == ROLLOUTS


def test_in_this_process(make, ppo):
    collector = Collector(
        make,
        ppo.actor,
        frames_per_batch=NUM_ENVS * STEPS,
        total_frames=ROLLOUTS * NUM_ENVS * STEPS,
        auto_register_policy_transforms=False,
    )
    try:
        _train(ppo, collector, NUM_ENVS)
    finally:
        collector.shutdown()


@pytest.mark.slow
def test_in_two_processes(make, ppo):
    with one_maths_thread():
        collector = MultiSyncCollector(
            [make, make],
            ppo.actor,
            frames_per_batch=2 * NUM_ENVS * STEPS,
            total_frames=ROLLOUTS * 2 * NUM_ENVS * STEPS,
            cat_results=0,
            auto_register_policy_transforms=False,
        )
    try:
        collector.set_seed(0)
        _train(ppo, collector, 2 * NUM_ENVS)
    finally:
        collector.shutdown()


@pytest.mark.slow
def test_on_ray(make, ppo):
    ray = pytest.importorskip("ray", reason="the extra 'ray' is not installed")
    from torchrl.collectors.distributed import RayCollector

    resources = {"num_cpus": 1, "num_gpus": 0, "memory": 512 * 1024**2}
    collector = RayCollector(
        [make, make],
        ppo.actor,
        frames_per_batch=2 * NUM_ENVS * STEPS,
        total_frames=ROLLOUTS * 2 * NUM_ENVS * STEPS,
        sync=True,
        collector_kwargs={"auto_register_policy_transforms": False},
        ray_init_config={"num_cpus": 2, "include_dashboard": False, "log_to_driver": False},
        remote_configs=resources,
    )
    try:
        _train(ppo, collector, 2 * NUM_ENVS)
    finally:
        collector.shutdown()
        ray.shutdown()
