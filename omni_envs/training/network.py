"""The networks: normalised observations, ELU layers, one deviation per joint."""

from __future__ import annotations

from collections.abc import Mapping

from omni_envs.errors import MissingDependencyError

try:
    import torch
    from torch import Tensor, nn
except ImportError as error:
    raise MissingDependencyError("torch", "sb3", "A policy network") from error

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
        output: nn.Linear,
        low: Tensor,
        high: Tensor,
    ) -> None:
        super().__init__()
        self.normalizer, self.hidden, self.output = normalizer, hidden, output
        self.register_buffer("low", low)
        self.register_buffer("high", high)

    @classmethod
    def from_weights(cls, weights: Mapping[str, Tensor]) -> Actor:
        """Rebuilds the actor from the weights of a whole policy (``Checkpoint.policy``)."""

        def part(prefix: str) -> dict[str, Tensor]:
            return {k.removeprefix(prefix): v for k, v in weights.items() if k.startswith(prefix)}

        layers, last = part("mlp_extractor.actor."), part("action_net.")
        matrices = [v for v in layers.values() if v.ndim == 2]
        network = ActorCriticNetwork(matrices[0].shape[1], 1, tuple(map(len, matrices)))
        network.actor_normalizer.load_state_dict(part("mlp_extractor.actor_normalizer."))
        network.actor.load_state_dict(layers)
        output = nn.Linear(last["weight"].shape[1], last["weight"].shape[0])
        output.load_state_dict(last)
        return cls(
            network.actor_normalizer,
            network.actor,
            output,
            weights["action_low"],
            weights["action_high"],
        )

    @property
    def observation_size(self) -> int:
        """Length of the observation."""
        return len(self.normalizer.mean)

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


def _layers(size: int, hidden: tuple[int, ...]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for width in hidden:
        layers += [nn.Linear(size, width), nn.ELU()]
        size = width
    return nn.Sequential(*layers)


def _pick(features: Tensor | Mapping[str, Tensor], key: str) -> Tensor:
    return features if isinstance(features, Tensor) else features[key]
