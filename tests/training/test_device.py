"""The network on a GPU: what can be told without one, and what takes one."""

import threading
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from gymnasium.vector import AutoresetMode  # noqa: E402
from torch.utils._python_dispatch import TorchDispatchMode  # noqa: E402

from omni_envs.errors import InvalidOptionError  # noqa: E402
from omni_envs.training.checkpoint import Checkpoint, checkpoints  # noqa: E402
from omni_envs.training.config import PPOConfig, TrainConfig  # noqa: E402
from omni_envs.training.device import read, second_worker, torch_device  # noqa: E402
from omni_envs.training.learner import make_learner  # noqa: E402

PACKAGES = {"sb3": "stable_baselines3", "torchrl": "torchrl"}
UPDATES = {"sb3": "ppo", "torchrl": "torchrl_ppo"}
"""Trainer to the module of its gradient steps: the other one's need not be installed."""
MODES = {"sb3": AutoresetMode.SAME_STEP, "torchrl": AutoresetMode.DISABLED}
PPO = PPOConfig(rollout_steps=8, epochs=3, minibatches=2, hidden=(16,))
GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")


@pytest.fixture(params=PACKAGES)
def trainer(request) -> str:
    pytest.importorskip(PACKAGES[request.param])
    return request.param


@pytest.fixture
def config(trainer, tmp_path) -> TrainConfig:
    return TrainConfig("Chase", tmp_path, 4 * 128, trainer, num_envs=16, ppo=PPO)


@pytest.fixture
def env(chase, trainer):
    return lambda: chase(16, True, MODES[trainer])


@pytest.mark.parametrize("found", [False, True])
def test_auto_takes_a_gpu_where_there_is_one(monkeypatch, found):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: found)
    monkeypatch.setattr(torch.cuda, "current_device", lambda: 1)
    assert torch_device("auto") == (torch.device("cuda", 1) if found else torch.device("cpu"))
    assert torch_device("cpu") == torch.device("cpu")


def test_a_gpu_that_is_not_there_is_one_clear_error(monkeypatch, config):
    pytest.importorskip("tensorboard")
    from omni_envs.training.run import train

    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InvalidOptionError, match=r"device: 'cuda' .* choose 'cpu', or 'auto'"):
        train(replace(config, device="cuda"))
    assert not list(config.out.iterdir())


def test_the_critic_has_a_thread_of_its_own_on_the_cpu_alone():
    for name, apart in (("cpu", True), ("cuda", False)):
        with second_worker(torch.device(name)) as second:
            thread = second.submit(lambda x: (threading.get_ident(), x), 3).result()
        assert (thread[0] != threading.get_ident(), thread[1]) == (apart, 3)


def test_figures_are_read_by_name():
    rows = [{"a": torch.tensor(1.0), "b": torch.tensor(0.1)}, {"b": torch.tensor(2.0)}]
    assert read(rows[:1]) == [{"a": 1.0, "b": float(np.float32(0.1))}]
    assert read(rows[1:]) == [{"b": 2.0}] and read([]) == []


class _Waits(TorchDispatchMode):
    """Counts what makes the CPU wait for a GPU: numbers and indices read out of tensors."""

    def __init__(self) -> None:
        super().__init__()
        self.reads = 0

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        name = func._schema.name
        self.reads += name in ("aten::_local_scalar_dense", "aten::nonzero", "aten::is_nonzero")
        return func(*args, **(kwargs or {}))


def _update(learner):
    """Returns the function that takes the gradient steps of a rollout, and the rollout."""
    if hasattr(learner, "_ppo"):
        return learner._ppo._update, learner._ppo._rollout()
    kept = []
    inner = learner.ppo.update
    learner.ppo.update = lambda samples: kept.append(samples.clone()) or inner(samples)
    learner.learn()
    return inner, kept[0]


@pytest.mark.parametrize("every", ["update", "minibatch"])
def test_gradient_steps_do_not_wait_for_a_gpu(monkeypatch, config, env, every):
    if config.trainer == "sb3":  # as where TorchRL, which switches this off, is not installed
        monkeypatch.setattr(torch.distributions.Distribution, "_validate_args", True)
    ppo = replace(PPO, adapt_every=every, critic_learning_rate=1e-3)
    learner = make_learner(replace(config, ppo=ppo), env())
    learner.learn()
    update, rollout = _update(learner)
    # One thread, as on a GPU: a dispatch mode sees its own thread alone.
    _work_in_turn(monkeypatch, config)
    readings = []
    name = "omni_envs.training.device.read"
    monkeypatch.setattr(name, lambda f: readings.append(len(f)) or read(f))
    with _Waits() as waits:
        update(rollout)
    learner.close()
    steps = ppo.epochs * ppo.minibatches
    assert [n for n in readings if n] == ([steps] if every == "update" else [1] * steps)
    # The deviation of the actions at the end; TorchRL's own losses look at three numbers a step.
    assert waits.reads <= 1 + (3 * steps if config.trainer == "torchrl" else 0)


def _work_in_turn(patch, config):
    """Has actor and critic take their steps in one thread, as on a GPU."""
    name = f"omni_envs.training.{UPDATES[config.trainer]}.second_worker"
    patch.setattr(name, lambda device: second_worker(torch.device("cuda")))


def test_both_ways_of_working_learn_the_same(monkeypatch, config, env):
    weights = []
    for in_turn in (False, True):
        with monkeypatch.context() as patch:
            if in_turn:
                _work_in_turn(patch, config)
            learner = make_learner(config, env())
            for _ in range(3):
                learner.learn()
            weights.append(learner.state(0.0, []).policy)
            learner.close()
    assert all(torch.equal(weights[0][key], weights[1][key]) for key in weights[0])


@GPU
def test_everything_of_the_network_lives_on_the_gpu(config, env):
    learner = make_learner(replace(config, device="cuda"), env())
    before = learner.state(0.0, []).policy["action_net.weight"].clone()
    for _ in range(3):
        figures = learner.learn()
    state = learner.state(0.0, [])
    assert all(np.isfinite(list(figures.values()))) and figures["kl"] > 0
    assert {t.device.type for t in state.policy.values()} == {"cuda"}
    moments = [m for row in state.optimizer["state"].values() for m in row.values()]
    assert {m.device.type for m in moments} == {"cuda"} and state.device_rng is not None
    assert not torch.equal(before, state.policy["action_net.weight"])
    seen = int(state.policy["mlp_extractor.actor_normalizer.count"])
    assert seen == learner.steps == 3 * 128
    learner.close()


@GPU
@pytest.mark.parametrize("way", [("cuda", "cpu"), ("cpu", "cuda"), ("cuda", "cuda")])
def test_a_run_goes_on_on_another_device(config, env, way):
    pytest.importorskip("tensorboard")
    from omni_envs.training.network_policy import NetworkPolicy, load_actor
    from omni_envs.training.run import train

    train(replace(config, device=way[0]), env=env())
    path = checkpoints(config.out)[-1]
    saved = Checkpoint.load(path)
    assert {t.device.type for t in saved.policy.values()} == {"cpu"}
    actions = NetworkPolicy(load_actor(path))(np.zeros((3, 2), np.float32), np.zeros(3))
    assert actions.shape == (3, 2) and np.isfinite(actions).all()
    result = train(replace(config, device=way[1], steps=8 * 128), resume=True, env=env())
    assert result.steps == 8 * 128 and TrainConfig.load(config.out).device == way[1]
    assert all(np.isfinite(row["value_loss"]) for row in result.history[2:])
