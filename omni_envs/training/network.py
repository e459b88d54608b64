"""The networks: normalised observations, ELU layers, one deviation per joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

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
        low: np.ndarray,
        high: np.ndarray,
    ) -> None:
        super().__init__()
        self.normalizer, self.hidden, self.output = normalizer, hidden, output
        self.register_buffer("low", torch.as_tensor(low, dtype=torch.float32))
        self.register_buffer("high", torch.as_tensor(high, dtype=torch.float32))

    @classmethod
    def from_weights(
        cls, weights: Mapping[str, Tensor], low: np.ndarray, high: np.ndarray
    ) -> Actor:
        """Rebuilds the actor from the weights of a whole policy (``Checkpoint.policy``)."""
        prefix = "mlp_extractor.actor."
        matrices = [v for k, v in weights.items() if k.startswith(prefix) and v.ndim == 2]
        hidden = tuple(len(matrix) for matrix in matrices)
        network = ActorCriticNetwork(matrices[0].shape[1], 1, hidden)
        output = nn.Linear(hidden[-1], len(weights["action_net.weight"]))
        actor = cls(network.actor_normalizer, network.actor, output, low, high)
        state = {"low": actor.low, "high": actor.high}
        for name, prefix in (
            ("normalizer", "mlp_extractor.actor_normalizer."),
            ("hidden", "mlp_extractor.actor."),
            ("output", "action_net."),
        ):
            for key, value in weights.items():
                if key.startswith(prefix):
                    state[f"{name}.{key.removeprefix(prefix)}"] = value
        actor.load_state_dict(state)
        return actor

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
