"""The actor-critic network: normalised observations, ELU layers, one deviation per joint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from omni_envs.errors import InvalidDataError, MissingDependencyError

try:
    import torch
    from stable_baselines3.common.policies import ActorCriticPolicy
    from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
    from torch import Tensor, nn
except ImportError as error:
    raise MissingDependencyError("stable-baselines3", "sb3", "Training with SB3") from error

from omni_envs.training.normalizer import RunningNormalizer

POLICY, CRITIC = "policy", "critic"
"""Keys of a privileged observation: what the robot knows, and what only the simulator knows."""


class Actor(nn.Module):
    """Observation → mean action: the part of a policy that is exported.

    Args:
        normalizer: Observation normalisation.
        hidden: Hidden layers.
        output: Linear layer to the action.
        low: (n,) smallest action that the environment takes.
        high: (n,) largest action that the environment takes.
    """

    low: Tensor
    high: Tensor

    def __init__(
        self,
        normalizer: RunningNormalizer,
        hidden: nn.Module,
        output: nn.Module,
        low: np.ndarray,
        high: np.ndarray,
    ) -> None:
        super().__init__()
        self.normalizer, self.hidden, self.output = normalizer, hidden, output
        self.register_buffer("low", torch.as_tensor(low, dtype=torch.float32))
        self.register_buffer("high", torch.as_tensor(high, dtype=torch.float32))

    def forward(self, observation: Tensor) -> Tensor:
        """Returns the deterministic action (N, n), clipped to what the environment takes."""
        action = self.output(self.hidden(self.normalizer(observation)))
        return torch.clamp(action, self.low, self.high)


class ActorCriticNetwork(nn.Module):
    """Separate normaliser and hidden layers for actor and critic, in the shape SB3 asks for."""

    def __init__(self, actor_size: int, critic_size: int, hidden: tuple[int, ...]) -> None:
        super().__init__()
        self.actor_normalizer = RunningNormalizer(actor_size)
        self.critic_normalizer = RunningNormalizer(critic_size)
        self.actor, self.critic = _layers(actor_size, hidden), _layers(critic_size, hidden)
        self.latent_dim_pi = self.latent_dim_vf = hidden[-1]

    def forward(self, features: Tensor | Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Returns the last hidden layer of actor and critic."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: Tensor | Mapping[str, Tensor]) -> Tensor:
        """Returns the last hidden layer of the actor."""
        return self.actor(self.actor_normalizer(_pick(features, POLICY)))

    def forward_critic(self, features: Tensor | Mapping[str, Tensor]) -> Tensor:
        """Returns the last hidden layer of the critic."""
        return self.critic(self.critic_normalizer(_pick(features, CRITIC)))

    def update_normalizers(self, features: Tensor | Mapping[str, Tensor]) -> None:
        """Feeds observations (N, ·) to both normalisers."""
        self.actor_normalizer.update(_pick(features, POLICY))
        self.critic_normalizer.update(_pick(features, CRITIC))


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

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = ActorCriticNetwork(*self._sizes, self._hidden)

    def actor(self) -> Actor:
        """Returns the deterministic actor; it shares the weights of this policy."""
        network = self.mlp_extractor
        space = self.action_space
        return Actor(
            network.actor_normalizer, network.actor, self.action_net, space.low, space.high
        )


class _Untouched(BaseFeaturesExtractor):
    """Hands the observation on as it is: actor and critic each take their own part of it."""

    def __init__(self, observation_space: spaces.Space) -> None:
        super().__init__(observation_space, features_dim=1)

    def forward(self, observation: Any) -> Any:
        return observation


def _layers(size: int, hidden: tuple[int, ...]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for width in hidden:
        layers += [nn.Linear(size, width), nn.ELU()]
        size = width
    return nn.Sequential(*layers)


def _pick(features: Tensor | Mapping[str, Tensor], key: str) -> Tensor:
    return features if isinstance(features, Tensor) else features[key]


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
