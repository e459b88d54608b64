"""The actor-critic network in TorchRL: plain modules that read and write tensordicts."""

from __future__ import annotations

from collections.abc import Iterable

from omni_envs.errors import InvalidDataError, MissingDependencyError

try:
    import torch
    from tensordict.nn import TensorDictModule
    from torch import Tensor, nn
    from torchrl.envs.utils import ExplorationType
    from torchrl.modules import IndependentNormal, ProbabilisticActor, ValueOperator
except ImportError as error:
    raise MissingDependencyError("torchrl", "torchrl", "Training with TorchRL") from error

from omni_envs.training.network import CRITIC, POLICY, ActorCriticNetwork

OBSERVATION = "observation"
"""Key of an observation that actor and critic share."""


class TrackingNetwork(nn.Module):
    """Actor and critic with the weights of ``TrackingPolicy``, under the same names.

    So checkpoints of both trainers are read by the same code, and weights can be exchanged.

    Args:
        actor_size: Length of the actor's observation.
        critic_size: Length of the critic's observation.
        low: (n,) smallest action that the environment takes.
        high: (n,) largest action that the environment takes.
        hidden: Widths of the hidden layers.
        initial_std: Standard deviation of the exploration noise at the start.
    """

    def __init__(
        self,
        actor_size: int,
        critic_size: int,
        low: Tensor,
        high: Tensor,
        hidden: tuple[int, ...] = (512, 256, 128),
        initial_std: float = 1.0,
    ) -> None:
        super().__init__()
        self.mlp_extractor = ActorCriticNetwork(actor_size, critic_size, hidden)
        self.action_net = nn.Linear(hidden[-1], len(low))
        self.value_net = nn.Linear(hidden[-1], 1)
        self.log_std = nn.Parameter(torch.full((len(low),), initial_std).log())
        # Kept with the weights, so that an actor can be rebuilt from them alone.
        self.register_buffer("action_low", low)
        self.register_buffer("action_high", high)
        # The gains that SB3 takes: small first actions, whatever the observation.
        for module, gain in (
            (self.mlp_extractor, 2.0**0.5),
            (self.action_net, 0.01),
            (self.value_net, 1.0),
        ):
            for layer in module.modules():
                if isinstance(layer, nn.Linear):
                    nn.init.orthogonal_(layer.weight, gain)
                    nn.init.zeros_(layer.bias)


class Gaussian(nn.Module):
    """Observation → mean and deviation (…, n) of the actions, not clipped."""

    def __init__(self, network: TrackingNetwork) -> None:
        super().__init__()
        parts = network.mlp_extractor
        self.mean = nn.Sequential(parts.actor_normalizer, parts.actor, network.action_net)
        self.log_std = network.log_std

    def forward(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Returns mean and deviation."""
        mean = self.mean(observation)
        return mean, self.log_std.exp().expand_as(mean)


def actor_and_critic(
    network: TrackingNetwork, keys: Iterable[str]
) -> tuple[ProbabilisticActor, ValueOperator]:
    """Returns a policy of TorchRL and a value operator on the weights of a network.

    Args:
        network: The weights.
        keys: Observations that the environment has.

    Returns:
        The actor, which writes ``loc``, ``scale``, ``action`` and ``action_log_prob``, and the
        critic, which writes ``state_value``.
    """
    seen, privileged = observation_keys(keys)
    actor = ProbabilisticActor(
        TensorDictModule(Gaussian(network), [seen], ["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=IndependentNormal,
        return_log_prob=True,
        default_interaction_type=ExplorationType.RANDOM,
    )
    parts = network.mlp_extractor
    value = nn.Sequential(parts.critic_normalizer, parts.critic, network.value_net)
    return actor, ValueOperator(value, in_keys=[privileged])


def observation_keys(keys: Iterable[str]) -> tuple[str, str]:
    """Returns the observations of actor and critic among all that there are.

    Raises:
        InvalidDataError: There is neither one for both nor one for each.
    """
    found = set(keys)
    if {POLICY, CRITIC} <= found:
        return POLICY, CRITIC
    if OBSERVATION in found:
        return OBSERVATION, OBSERVATION
    raise InvalidDataError(
        "TrackingNetwork",
        "observations",
        f"{OBSERVATION!r}, or {POLICY!r} and {CRITIC!r}",
        f"{sorted(found)}",
    )
