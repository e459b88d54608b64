"""The actor-critic network as a policy of Stable-Baselines3."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from omni_envs.errors import InvalidDataError, MissingDependencyError

try:
    import torch
    from stable_baselines3.common.distributions import DiagGaussianDistribution
    from stable_baselines3.common.policies import ActorCriticPolicy
    from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
    from torch import Tensor, nn
    from torch.distributions import Normal
except ImportError as error:
    raise MissingDependencyError("stable-baselines3", "sb3", "Training with SB3") from error

from omni_envs.training.network import CRITIC, POLICY, Actor, ActorCriticNetwork


class TrackingPolicy(ActorCriticPolicy):
    """SB3 policy with asymmetric actor and critic.

    The observation space is a ``Box``, seen by both, or a ``Dict`` with ``"policy"`` and
    ``"critic"``. Usable with plain ``stable_baselines3.PPO`` too, then without normalisation,
    since only ``TrackingPPO`` feeds the normalisers.

    Args:
        observation_space: ``Box`` or ``Dict`` of boxes.
        action_space: Bounded ``Box``.
        lr_schedule: Learning-rate schedule of SB3.
        hidden: Widths of the hidden layers.
        initial_std: Standard deviation of the exploration noise at the start.
        **kwargs: Passed to ``ActorCriticPolicy``.

    Raises:
        InvalidDataError: The observation space is of another kind.
    """

    def __init__(
        self,
        observation_space: spaces.Space,
        action_space: spaces.Box,
        lr_schedule: Any,
        *,
        hidden: tuple[int, ...] = (512, 256, 128),
        initial_std: float = 1.0,
        **kwargs: Any,
    ) -> None:
        self._sizes = _actor_and_critic_size(observation_space)
        self._hidden = tuple(hidden)
        super().__init__(
            observation_space,
            action_space,
            lr_schedule,
            activation_fn=nn.ELU,
            log_std_init=float(np.log(initial_std)),
            features_extractor_class=_Untouched,
            **kwargs,
        )
        self.action_dist = _UncheckedGaussian(action_space.shape[0])

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = ActorCriticNetwork(*self._sizes, self._hidden)
        # Kept with the weights, so that an actor can be rebuilt from them alone.
        self.register_buffer("action_low", torch.as_tensor(self.action_space.low))
        self.register_buffer("action_high", torch.as_tensor(self.action_space.high))

    def actor(self) -> Actor:
        """Returns the deterministic actor; it shares the weights of this policy."""
        network = self.mlp_extractor
        return Actor(
            network.actor_normalizer,
            network.actor,
            self.action_net,
            self.action_low,
            self.action_high,
        )


class _UncheckedGaussian(DiagGaussianDistribution):
    """Does not look at its numbers, for which a GPU would be waited for in every gradient step.

    What is not finite is found in the figures of the update.
    """

    def proba_distribution(self, mean_actions: Tensor, log_std: Tensor) -> _UncheckedGaussian:
        std = torch.ones_like(mean_actions) * log_std.exp()
        self.distribution = Normal(mean_actions, std, validate_args=False)
        return self


class _Untouched(BaseFeaturesExtractor):
    """Hands the observation on as it is: actor and critic each take their own part of it."""

    def __init__(self, observation_space: spaces.Space) -> None:
        super().__init__(observation_space, features_dim=1)

    def forward(self, observation: Any) -> Any:
        return observation


def _actor_and_critic_size(space: spaces.Space) -> tuple[int, int]:
    boxes = [space, space]
    if isinstance(space, spaces.Dict) and set(space.spaces) == {POLICY, CRITIC}:
        boxes = [space[POLICY], space[CRITIC]]
    sizes = []
    for box in boxes:
        if not isinstance(box, spaces.Box) or len(box.shape) != 1:
            raise InvalidDataError(
                "TrackingPolicy",
                "observation_space",
                f"a flat Box, or a Dict of two with the keys {POLICY!r} and {CRITIC!r}",
                str(space),
            )
        sizes.append(box.shape[0])
    return sizes[0], sizes[1]
