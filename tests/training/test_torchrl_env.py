import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

pytest.importorskip("torchrl")
import torch
from tensordict import TensorDict
from torchrl.envs.utils import check_env_specs

from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.training.torchrl_env import make_torchrl_env

ID = "OmniEnvs/G1BoxCarry-v0"


@pytest.fixture(scope="module")
def reference(sway, tmp_path_factory):
    return str(sway().save(tmp_path_factory.mktemp("references") / "sway.npz"))


@pytest.mark.parametrize("privileged", [False, True])
def test_specs_hold(reference, privileged):
    env = make_torchrl_env(
        ID, 3, reference=reference, num_threads=1, observation={"privileged": privileged}
    )
    check_env_specs(env)
    assert env.batch_size == (3,)
    found = {"policy", "critic"} if privileged else {"observation"}
    assert found <= set(env.observation_spec.keys())
    env.close()


def test_infos_become_entries(reference):
    env = make_torchrl_env(
        ID, 3, infos=("diverged", "error/body_position"), reference=reference, num_threads=1
    )
    check_env_specs(env)
    step = env.rand_step(env.reset())["next"]
    assert step["diverged"].tolist() == [0.0] * 3
    assert (step["error/body_position"] > 0).all()
    env.close()
    env = make_torchrl_env(ID, 3, infos=("rewards",), reference=reference, num_threads=1)
    with pytest.raises(UnknownNameError, match=r"info 'rewards'.*Valid:.*reward/contact"):
        env.rand_step(env.reset())
    env.close()


def test_seed_makes_rollouts_repeat(reference):
    rollouts = []
    for seed in (3, 3, 4):
        env = make_torchrl_env(ID, 2, reference=reference, num_threads=1)
        env.set_seed(seed)
        torch.manual_seed(0)
        rollouts.append(env.rollout(5, break_when_any_done=False)["next", "observation"])
        env.close()
    assert torch.equal(rollouts[0], rollouts[1])
    assert not torch.equal(rollouts[0], rollouts[2])


@pytest.mark.parametrize("privileged", [False, True])
def test_next_is_what_the_action_led_to(chase, privileged):
    """Simulation 0 leaves the field (terminated), the others stand still (truncated at 20)."""
    inner = chase(4, privileged, AutoresetMode.DISABLED)
    env = make_torchrl_env(inner)
    env.set_seed(3)
    key = "policy" if privileged else "observation"
    state, ends = env.reset(), {"terminated": 0, "truncated": 0}
    for _ in range(45):
        before = inner.position.copy()
        assert torch.allclose(state[key], torch.as_tensor(before * 5 + 3, dtype=torch.float32))
        action = torch.zeros(4, 2)
        action[0] = 2.0
        stepped, state = env.step_and_maybe_reset(state.set("action", action))
        led_to = torch.as_tensor((before + 0.1 * action.numpy()) * 5 + 3, dtype=torch.float32)
        assert torch.allclose(stepped["next", key], led_to, atol=1e-5)
        done = stepped["next", "done"].squeeze(-1)
        out = stepped["next", "terminated"].squeeze(-1)
        late = stepped["next", "truncated"].squeeze(-1)
        assert torch.equal(done, out | late)
        assert not out[1:].any() and not late[0]
        ends["terminated"] += int(out.sum())
        ends["truncated"] += int(late.sum())
        # What ended starts anew, what did not goes on from there.
        assert torch.equal(state[key][~done], stepped["next", key][~done])
        assert not (state[key][done] == stepped["next", key][done]).all(dim=-1).any()
    assert ends["terminated"] >= 4 and ends["truncated"] == 3 * 2


def test_returns_and_lengths_count_from_the_start_of_the_episode(chase):
    env = make_torchrl_env(chase(3, False, AutoresetMode.DISABLED))
    env.set_seed(0)
    still = lambda td: td.set("action", torch.zeros(3, 2))  # noqa: E731
    rollout = env.rollout(41, still, break_when_any_done=False)
    ended = rollout["next", "done"].squeeze(-1)
    assert ended.nonzero().tolist() == [[i, t] for i in range(3) for t in (19, 39)]
    assert rollout["next", "step_count"][ended].tolist() == [[20]] * 6
    summed = rollout["next", "reward"][:, :40].reshape(3, 2, 20).sum(-1)
    torch.testing.assert_close(rollout["next", "episode_reward"][ended].reshape(3, 2), summed)


def test_actions_beyond_the_space_are_kept_as_sampled(reference):
    env = make_torchrl_env(ID, 2, reference=reference, num_threads=1)
    state = env.reset().set("action", torch.full((2, 29), 50.0))
    stepped = env.step(state)
    assert (stepped["action"] == 50.0).all()
    assert (stepped["next", "observation"][:, 131:] == 10.0).all()  # the action that was taken
    env.close()


def test_bad_arguments_are_one_clear_error(chase):
    with pytest.raises(InvalidOptionError, match="G1BoxCarry"):
        make_torchrl_env("OmniEnvs/G1BoxCary-v0")
    with pytest.raises(InvalidOptionError, match=r"'rewrd'.*Did you mean 'reward'"):
        make_torchrl_env(ID, rewrd={})
    with pytest.raises(InvalidOptionError, match=r"must be DISABLED; got SAME_STEP"):
        make_torchrl_env(chase(2))


def test_a_foreign_tensordict_resets_only_what_it_marks(chase):
    inner = chase(3, False, AutoresetMode.DISABLED)
    env = make_torchrl_env(inner)
    env.reset()
    before = inner.position.copy()
    mask = torch.tensor([[False], [True], [False]])
    env.reset(TensorDict({"_reset": mask}, [3]))
    assert (np.abs(inner.position - before).sum(axis=1) > 0).tolist() == [False, True, False]
