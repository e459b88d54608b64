"""The environments in TorchRL: simulations as one batch, with true terminal observations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gymnasium.vector import AutoresetMode, VectorEnv

from omni_envs.errors import InvalidOptionError, MissingDependencyError, UnknownNameError

try:
    import torch
    from tensordict import TensorDictBase
    from torchrl.data import Composite, Unbounded
    from torchrl.envs import Compose, EnvBase, GymWrapper, RewardSum, StepCounter, TransformedEnv
    from torchrl.envs.gym_like import BaseInfoDictReader
except ImportError as error:
    raise MissingDependencyError("torchrl", "torchrl", "An environment in TorchRL") from error

from omni_envs.training.environment import make_vector_env

EPISODE_RETURN, EPISODE_LENGTH = "episode_reward", "step_count"
"""Entries under ``"next"``: sum of rewards and control steps (N, 1) since the episode's start."""


def make_torchrl_env(
    env: str | VectorEnv,
    num_envs: int = 1,
    *,
    infos: Sequence[str] = (),
    **options: Any,
) -> EnvBase:
    """Makes an environment of TorchRL whose batch is its N simulations.

    A finished simulation waits for its reset (autoreset mode DISABLED), so that ``"next"`` is
    always what the action led to, and ``terminated`` and ``truncated`` are apart: value estimators
    bootstrap a motion that is over or out of time, but no failure.

    The simulations run in the threads of one process. Collectors that start processes take a
    function; give each process few threads::

        make = partial(make_torchrl_env, "OmniEnvs/G1BoxCarry-v0", 32, num_threads=1)
        collector = MultiSyncCollector([make, make], policy, frames_per_batch=1024)

    Args:
        env: Environment id, or a vector environment in autoreset mode DISABLED.
        num_envs: N, with an id.
        infos: Infos of each step that become entries (N,) under ``"next"``, such as
            ``"reward/contact"``.
        **options: Options of the environment, with an id, as ``gymnasium.make_vec`` takes them.

    Returns:
        An environment of batch size (N,). Observations are at ``"observation"`` (N, ·), or at
        ``"policy"`` and ``"critic"`` with ``observation={"privileged": True}``; actions (N, n) are
        clipped to the action space by the environment; ``"episode_reward"`` and ``"step_count"``
        (N, 1) count from the start of the episode.

    Raises:
        InvalidOptionError: There is no such environment, or its autoreset mode is another one.
        OmniEnvsError: An option is not valid.
    """
    if isinstance(env, str):
        mode = AutoresetMode.DISABLED.name
        vector = make_vector_env(env, num_envs, autoreset_mode=mode, **options)
    else:
        vector = env
    found = vector.metadata.get("autoreset_mode")
    if found is not AutoresetMode.DISABLED:
        raise InvalidOptionError(
            "make_torchrl_env: autoreset_mode must be DISABLED; "
            f"got {getattr(found, 'name', found)}."
        )
    wrapped = GymWrapper(vector)
    if infos:
        wrapped.set_info_dict_reader(_Infos(infos, wrapped.batch_size))
    return TransformedEnv(wrapped, Compose(RewardSum(), StepCounter()))


class _Infos(BaseInfoDictReader):
    """Infos as entries of 32-bit floats; a reset has none, and zeros stand in their place."""

    def __init__(self, names: Sequence[str], size: torch.Size) -> None:
        self._spec = Composite({name: Unbounded(size) for name in names}, shape=size)

    @property
    def info_spec(self) -> Composite:
        return self._spec

    def __call__(self, info_dict: dict[str, Any], tensordict: TensorDictBase) -> TensorDictBase:
        stepped = "reward" in tensordict.keys()  # noqa: SIM118 (a tensordict iterates over its rows)
        for name, spec in self._spec.items():
            if name in info_dict:
                tensordict.set(name, torch.as_tensor(info_dict[name], dtype=torch.float32))
            elif stepped:
                names = [n for n in info_dict if not n.startswith("_")]
                raise UnknownNameError("info", name, names)
            else:
                tensordict.set(name, spec.zero())
        return tensordict
