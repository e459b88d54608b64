"""The environments in TorchRL's own wrappers, which must see true terminal observations."""

import pytest
from gymnasium.vector import AutoresetMode

from omni_envs.envs import OmniVectorEnv

torchrl_envs = pytest.importorskip("torchrl.envs")
from torchrl.envs.utils import check_env_specs  # noqa: E402


@pytest.mark.parametrize("privileged", [False, True])
def test_rollout_in_gym_wrapper(reference, privileged):
    env = OmniVectorEnv(
        4,
        reference=reference,
        observation={"privileged": privileged},
        autoreset_mode=AutoresetMode.DISABLED,
    )
    wrapped = torchrl_envs.GymWrapper(env)
    rollout = wrapped.rollout(40, break_when_any_done=False)
    assert rollout.batch_size == (4, 40)
    ended = rollout["next", "done"].squeeze(-1)
    assert ended.any()
    key = "policy" if privileged else "observation"
    last = rollout["next", key][ended]
    assert (last.abs().sum(-1) > 1.0).all()  # not the zeros of a lost terminal observation
    # Where nothing ended, the next step starts from the observation that this one led to.
    going = ~ended[:, :-1]
    assert (rollout["next", key][:, :-1][going] == rollout[key][:, 1:][going]).all()
    wrapped.close()


@pytest.mark.parametrize("privileged", [False, True])
def test_single_environment_by_id(reference_file, privileged):
    env = torchrl_envs.GymEnv(
        "OmniEnvs/G1BoxCarry-v0", reference=reference_file, observation={"privileged": privileged}
    )
    check_env_specs(env)
    rollout = env.rollout(200)
    assert env.batch_size == () and rollout.ndim == 1
    assert rollout["next", "done"].squeeze(-1).tolist() == [False] * (len(rollout) - 1) + [True]
    env.close()
