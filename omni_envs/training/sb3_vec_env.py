"""A Gymnasium vector environment seen as a Stable-Baselines3 ``VecEnv``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from omni_envs.errors import InvalidOptionError, MissingDependencyError

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:
    raise MissingDependencyError("stable-baselines3", "sb3", "Training with SB3") from error

Observation = np.ndarray | dict[str, np.ndarray]


class SB3VecEnv(VecEnv):
    """Adapter: ``SB3VecEnv(gymnasium.make_vec(...))`` trains with any SB3 algorithm.

    Finished episodes carry ``terminal_observation``, ``TimeLimit.truncated`` and the final info;
    the info of a running episode is empty, since making hundreds of dictionaries per step costs
    more than it tells. The batched infos of the last step are in ``batched_infos``.

    Args:
        env: Vector environment in SAME_STEP autoreset mode.

    Raises:
        InvalidOptionError: The autoreset mode is another one.
    """

    def __init__(self, env: VectorEnv) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise InvalidOptionError(
                f"SB3VecEnv: autoreset_mode must be SAME_STEP; got {getattr(mode, 'name', mode)}."
            )
        self.env = env
        self.spec = env.spec
        self.batched_infos: dict[str, Any] = {}
        self._actions: np.ndarray | None = None
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Observation:
        """Resets every environment, with the seed given to ``seed``, once."""
        options = next((o for o in self._options if o), None)
        observations, self.batched_infos = self.env.reset(seed=self._seeds[0], options=options)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Keeps the actions for ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> tuple[Observation, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Steps every environment with the kept actions."""
        observations, rewards, terminated, truncated, infos = self.env.step(self._actions)
        self.batched_infos = infos
        done = np.logical_or(terminated, truncated)
        rows: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done):
            rows[i] = {
                **_row(infos.get("final_info", {}), i),
                "terminal_observation": _element(infos["final_obs"], i),
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
            }
        return observations, np.asarray(rewards, np.float32), done, rows

    def close(self) -> None:
        """Closes the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Returns the attribute of the vector environment, once per index."""
        owner = self.env if hasattr(self.env, attr_name) else self.env.unwrapped
        return [getattr(owner, attr_name)] * len(self._numbers(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused: the simulations share one object."""
        raise NotImplementedError("The simulations of a vector environment share its attributes.")

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Refused: the simulations share one object."""
        raise NotImplementedError("The simulations of a vector environment share its methods.")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Returns False: there are no single environments to wrap."""
        return [False] * len(self._numbers(indices))

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Returns the pictures of the environment's ``render``."""
        pictures: Any = self.env.render()
        return list(pictures or ())

    def _numbers(self, indices: int | Iterable[int] | None) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        return [indices] if isinstance(indices, int) else list(indices)


def _element(batch: Any, i: int) -> Any:
    """Element i of a batched observation; object arrays of observations work too."""
    if isinstance(batch, Mapping):
        return {key: value[i] for key, value in batch.items()}
    return batch[i]


def _row(infos: Mapping[str, Any], i: int) -> dict[str, Any]:
    """Infos of environment i out of batched infos, Gymnasium's ``_key`` masks applied."""
    return {
        key: value[i]
        for key, value in infos.items()
        if isinstance(value, np.ndarray) and not key.startswith("_") and _has(infos, key, i)
    }


def _has(infos: Mapping[str, Any], key: str, i: int) -> bool:
    mask = infos.get(f"_{key}")
    return mask is None or bool(mask[i])
