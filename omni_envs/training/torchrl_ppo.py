"""PPO on tensordicts, with TorchRL's own parts: the recipe of ``TrackingPPO``.

Where a part of TorchRL does what the recipe says it is used: ``GAE`` bootstraps what was truncated
and normalises advantages over the rollout, ``ClipPPOLoss`` has the clipped surrogate, the entropy
bonus and the larger of the clipped and the plain value loss. Where none does, it is written out
here: the learning rate follows the exact KL divergence of the Gaussians (TorchRL's
``kl_approx`` is an estimate from samples, which is noisy and can be negative), and the observation
statistics are those of the network (``VecNormV2`` would hold them in the environment, where every
collector has its own and the exported policy none) and are fed after the update, so that a
rollout and its update see the same network.
"""

from __future__ import annotations

from typing import Any

from omni_envs.errors import MissingDependencyError

try:
    import torch
    from tensordict import TensorDictBase
    from torch import Tensor, nn
    from torch.distributions import kl_divergence
    from torchrl.modules import IndependentNormal, ProbabilisticActor, ValueOperator
    from torchrl.objectives import ClipPPOLoss
    from torchrl.objectives.value import GAE
except ImportError as error:
    raise MissingDependencyError("torchrl", "torchrl", "Training with TorchRL") from error

from omni_envs.training.config import PPOConfig
from omni_envs.training.device import read_and_clear, second_worker
from omni_envs.training.learning_rate import adapted_learning_rate
from omni_envs.training.torchrl_network import TrackingNetwork


class PolicyLoss(ClipPPOLoss):
    """Keeps the newest distribution, so that its divergence costs no second forward pass."""

    now: IndependentNormal

    def _get_cur_log_prob(
        self, *args: Any, **kwargs: Any
    ) -> tuple[Tensor, IndependentNormal, bool]:
        log_probability, self.now, composite = super()._get_cur_log_prob(*args, **kwargs)
        return log_probability, self.now, composite


class TensorDictPPO:
    """PPO for batches of any collector.

    Args:
        network: The weights.
        actor: Policy that collected, on these weights.
        critic: Value operator on these weights.
        config: Hyper-parameters.

    Attributes:
        network: The weights.
        optimizer: Adam.
        learning_rate: Learning rate of the next gradient step.
        updates: Passes over a rollout so far.
    """

    def __init__(
        self,
        network: TrackingNetwork,
        actor: ProbabilisticActor,
        critic: ValueOperator,
        config: PPOConfig | None = None,
    ) -> None:
        self.config = config = config or PPOConfig()
        self.network, self.actor, self.critic = network, actor, critic
        self.learning_rate, self.updates = config.learning_rate, 0
        self.optimizer = self._make_optimizer()
        self.advantages = GAE(
            gamma=config.gamma,
            lmbda=config.gae_lambda,
            value_network=critic,
            average_gae=True,
            deactivate_vmap=True,
        )
        self.policy_loss = PolicyLoss(
            actor,
            clip_epsilon=config.clip,
            entropy_coeff=config.entropy_weight,
            functional=False,
        )
        self.value_loss = ClipPPOLoss(
            actor,
            critic,
            critic_coeff=1.0,
            loss_critic_type="l2",
            clip_value=config.value_clip or None,
            log_explained_variance=False,
            functional=False,
        ).loss_critic

    def learn(self, rollout: TensorDictBase) -> dict[str, float]:
        """Updates the network from a rollout, the very first one only its normalisers.

        Args:
            rollout: (…, N, T), what a collector with this actor yields.

        Returns:
            Means over the gradient steps: ``kl``, ``surrogate_loss``, ``value_loss``, ``entropy``,
            ``clip_fraction``; ``learning_rate`` and ``action_std`` at the end. Empty if there was
            no update.

        Raises:
            OmniEnvsError: The loss is not finite any more.
        """
        normalizers = self.network.mlp_extractor
        figures: dict[str, float] = {}
        rollout = rollout.reshape(-1, rollout.shape[-1])
        if int(normalizers.actor_normalizer.count) > 0:
            with torch.no_grad():
                self.advantages(rollout)
            figures = self.update(rollout.exclude("next").transpose(0, 1).flatten())
        seen, privileged = self.actor.in_keys[0], self.critic.in_keys[0]
        normalizers.actor_normalizer.update(rollout[seen].flatten(0, -2))
        normalizers.critic_normalizer.update(rollout[privileged].flatten(0, -2))
        return figures

    def update(self, samples: TensorDictBase) -> dict[str, float]:
        """Takes the gradient steps of a rollout; see ``learn``.

        Args:
            samples: (B,) observations, ``action``, ``action_log_prob``, ``loc``, ``scale``,
                ``state_value``, ``value_target`` and ``advantage``.
        """
        config, device = self.config, self.network.log_std.device
        taken: list[dict[str, Tensor]] = []
        figures: list[dict[str, float]] = []
        with second_worker(device) as second:
            for _ in range(config.epochs):
                order = torch.randperm(len(samples), device=device)
                for index in order.tensor_split(config.minibatches):
                    batch = samples[index]
                    self.optimizer.zero_grad()
                    value = second.submit(self.critic_backward, batch)
                    taken.append(self.actor_backward(batch) | value.result())
                    if config.adapt_every == "minibatch":
                        figures += read_and_clear(taken, f"{self.updates} passes")
                        self.adapt_learning_rate(figures[-1]["kl"])
                    nn.utils.clip_grad_norm_(self.network.parameters(), config.max_grad_norm)
                    self.optimizer.step()
                self.updates += 1
        figures += read_and_clear(taken, f"{self.updates} passes")
        if config.adapt_every == "update":
            last = figures[-config.minibatches :]
            self.adapt_learning_rate(sum(row["kl"] / config.minibatches for row in last))
        return {
            **{name: sum(row[name] for row in figures) / len(figures) for name in figures[0]},
            "learning_rate": self.learning_rate,
            "action_std": self.network.log_std.exp().mean().item(),
        }

    def actor_backward(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """Adds the gradient of clipped surrogate, entropy and size; returns the figures to log."""
        losses = self.policy_loss(batch)
        now = self.policy_loss.now.base_dist
        size = self.config.action_weight * now.mean.square().sum(dim=-1).mean()
        (losses["loss_objective"] + losses["loss_entropy"] + size).backward()
        with torch.no_grad():
            acted = IndependentNormal(batch["loc"], batch["scale"]).base_dist
            kl = kl_divergence(acted, now)
        return {
            "kl": kl.sum(dim=-1).mean(),
            "surrogate_loss": losses["loss_objective"].detach(),
            "entropy": losses["entropy"].detach(),
            "clip_fraction": losses["clip_fraction"].detach(),
        }

    def critic_backward(self, batch: TensorDictBase) -> dict[str, Tensor]:
        """Adds the gradient of the value loss; returns the figures to log."""
        losses, *_ = self.value_loss(batch.clone(False))
        loss = losses.mean()
        (self.config.value_weight * loss).backward()
        return {"value_loss": loss.detach()}

    def adapt_learning_rate(self, kl: float) -> None:
        """Has the learning rate of the next gradient step follow the divergence."""
        rate = adapted_learning_rate(self.learning_rate, kl, self.config.desired_kl)
        self.learning_rate = rate
        # A second group is the critic's, whose rate is constant.
        self.optimizer.param_groups[0]["lr"] = rate

    def _make_optimizer(self) -> torch.optim.Adam:
        config, parameters = self.config, list(self.network.parameters())
        groups: list[dict[str, Any]] = [{"params": parameters, "lr": config.learning_rate}]
        if config.critic_learning_rate:
            critic = list(self.critic.parameters())
            members = {id(p) for p in critic}
            groups[0]["params"] = [p for p in parameters if id(p) not in members]
            groups.append({"params": critic, "lr": config.critic_learning_rate})
        return torch.optim.Adam(groups, fused=True)
