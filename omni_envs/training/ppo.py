"""PPO as rsl_rl writes it, inside Stable-Baselines3: adaptive learning rate and clipped values.

SB3 collects, bootstraps truncated episodes and computes advantages; the update is here, readable
in one piece. Differences from SB3's own: the learning rate follows the KL divergence of the whole
Gaussian, advantages are normalised per rollout instead of per mini-batch, the value loss is the
larger of the clipped and the plain one, and observation normalisers are fed after the update, so
that a rollout and its update see the same network.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from omni_envs.errors import MissingDependencyError

try:
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.logger import Logger
    from stable_baselines3.common.vec_env import VecEnv
    from torch import Tensor, nn
except ImportError as error:
    raise MissingDependencyError("stable-baselines3", "sb3", "Training with SB3") from error

from omni_envs.training.config import PPOConfig
from omni_envs.training.device import read_and_clear, second_worker
from omni_envs.training.learning_rate import adapted_learning_rate
from omni_envs.training.policy import TrackingPolicy
from omni_envs.training.torch_threads import torch_threads


@dataclass
class Rollout:
    """A rollout as flat tensors: B = rollout steps × environments samples.

    Attributes:
        observations: (B, ·), or one such tensor for actor and one for critic.
        actions: (B, n) as sampled, before clipping to the action space.
        log_probability: (B,) of the actions when they were taken.
        values: (B,) predicted when the actions were taken.
        returns: (B,) λ-returns.
        advantages: (B,) normalised to mean 0 and deviation 1 over the rollout.
        mean: (B, n) of the policy that acted.
        std: (B, n) of the policy that acted.
    """

    observations: Tensor | dict[str, Tensor]
    actions: Tensor
    log_probability: Tensor
    values: Tensor
    returns: Tensor
    advantages: Tensor
    mean: Tensor
    std: Tensor

    def minibatches(self, count: int) -> Iterator[Rollout]:
        """Yields ``count`` random parts, every sample in exactly one."""
        order = torch.randperm(len(self.actions), device=self.actions.device)
        for index in order.tensor_split(count):
            yield Rollout(**{name: _take(value, index) for name, value in vars(self).items()})


class TrackingPPO(PPO):
    """SB3's PPO with the update of rsl_rl.

    Args:
        env: SB3 vector environment.
        config: Hyper-parameters.
        seed: Seed of network, exploration and environment.
        device: Where the network lives and learns.
        policy: As SB3's ``load`` gives it back: always ``TrackingPolicy``.
        _init_setup_model: False while ``load`` builds it.

    Attributes:
        current_learning_rate: Learning rate of the next gradient step.
        figures: Figures of the newest update: ``kl``, ``surrogate_loss``, ``value_loss``,
            ``entropy``, ``clip_fraction``, ``learning_rate``, ``action_std``. SB3's own logger
            writes nothing unless ``set_logger`` gives it an output.
    """

    policy: TrackingPolicy

    def __init__(
        self,
        env: VecEnv,
        config: PPOConfig | None = None,
        seed: int | None = None,
        device: torch.device | str = "cpu",
        *,
        policy: type[TrackingPolicy] = TrackingPolicy,
        _init_setup_model: bool = True,
    ) -> None:
        config = config or PPOConfig()
        self.config = config
        num_envs = 1 if env is None else env.num_envs  # a model may be loaded without one
        super().__init__(
            policy,
            env,
            learning_rate=config.learning_rate,
            n_steps=config.rollout_steps,
            batch_size=max(2, config.rollout_steps * num_envs // config.minibatches),
            n_epochs=config.epochs,
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
            clip_range=config.clip,
            clip_range_vf=config.value_clip or None,
            ent_coef=config.entropy_weight,
            vf_coef=config.value_weight,
            max_grad_norm=config.max_grad_norm,
            policy_kwargs={
                "hidden": config.hidden,
                "initial_std": config.initial_std,
                "optimizer_kwargs": {"fused": True},
            },
            seed=seed,
            device=device,
            stats_window_size=max(100, num_envs),
            _init_setup_model=_init_setup_model,
        )
        self.set_logger(Logger(None, []))
        self.current_learning_rate = config.learning_rate
        self.figures: dict[str, float] = {}

    def _setup_model(self) -> None:
        super()._setup_model()
        if self.config.critic_learning_rate:
            self._split_optimizer(self.config.critic_learning_rate)

    def collect_rollouts(self, *args: Any, **kwargs: Any) -> bool:
        """Collects a rollout with one thread for the network: the cores belong to the physics."""
        with torch_threads(1):
            return super().collect_rollouts(*args, **kwargs)

    def train(self) -> None:
        """Updates the network from the rollout that was just collected.

        The very first rollout only feeds the normalisers.

        Raises:
            OmniEnvsError: The loss is not finite any more.
        """
        network = self.policy.mlp_extractor
        # Actor and critic learn at the same time: half of the cores for each.
        with torch_threads(max(1, (os.cpu_count() or 1) // 2)):
            rollout = self._rollout()
            if int(network.actor_normalizer.count) > 0:
                self._update(rollout)
            network.update_normalizers(rollout.observations)

    def _rollout(self) -> Rollout:
        buffer = self.rollout_buffer

        def flat(array: Any) -> Tensor:
            return torch.from_numpy(array).flatten(0, 1).to(self.device)

        seen = buffer.observations
        seen = {k: flat(v) for k, v in seen.items()} if isinstance(seen, dict) else flat(seen)
        with torch.no_grad():
            acted = self.policy.get_distribution(seen).distribution
        advantages = flat(buffer.advantages)
        return Rollout(
            seen,
            flat(buffer.actions),
            flat(buffer.log_probs),
            flat(buffer.values),
            flat(buffer.returns),
            (advantages - advantages.mean()) / (advantages.std() + 1e-8),
            acted.mean,
            acted.stddev,
        )

    def _update(self, rollout: Rollout) -> None:
        config, policy = self.config, self.policy
        policy.set_training_mode(True)
        taken: list[dict[str, Tensor]] = []
        figures: list[dict[str, float]] = []
        with second_worker(self.device) as second:
            for _ in range(config.epochs):
                for batch in rollout.minibatches(config.minibatches):
                    policy.optimizer.zero_grad()
                    value = second.submit(self._critic_backward, batch)
                    taken.append(self._actor_backward(batch) | value.result())
                    if config.adapt_every == "minibatch":
                        figures += read_and_clear(taken, f"{self.num_timesteps} steps")
                        self._adapt_learning_rate(figures[-1]["kl"])
                    nn.utils.clip_grad_norm_(policy.parameters(), config.max_grad_norm)
                    policy.optimizer.step()
                self._n_updates += 1
        figures += read_and_clear(taken, f"{self.num_timesteps} steps")
        if config.adapt_every == "update":
            last = figures[-config.minibatches :]
            self._adapt_learning_rate(sum(row["kl"] / config.minibatches for row in last))
        self.figures = {
            **{name: sum(row[name] for row in figures) / len(figures) for name in figures[0]},
            "learning_rate": self.current_learning_rate,
            "action_std": policy.log_std.exp().mean().item(),
        }

    def _actor_backward(self, batch: Rollout) -> dict[str, Tensor]:
        """Adds the gradient of clipped surrogate, entropy and size; returns the figures to log."""
        clip = self.config.clip
        now = self.policy.get_distribution(batch.observations).distribution
        log_probability = now.log_prob(batch.actions).sum(dim=-1)
        ratio = torch.exp(log_probability - batch.log_probability)
        clipped = ratio.clamp(1.0 - clip, 1.0 + clip)
        surrogate = -torch.min(ratio * batch.advantages, clipped * batch.advantages).mean()
        entropy = now.entropy().sum(dim=-1).mean()
        size = now.mean.square().sum(dim=-1).mean()
        loss = surrogate - self.config.entropy_weight * entropy + self.config.action_weight * size
        loss.backward()
        with torch.no_grad():
            kl = _gaussian_kl(batch.mean, batch.std, now.mean, now.stddev)
        return {
            "kl": kl,
            "surrogate_loss": surrogate.detach(),
            "entropy": entropy.detach(),
            "clip_fraction": (ratio != clipped).float().mean(),
        }

    def _critic_backward(self, batch: Rollout) -> dict[str, Tensor]:
        """Adds the gradient of the value loss, the larger of the plain and the clipped one."""
        values = self.policy.predict_values(batch.observations).flatten()
        loss = _value_loss(values, batch.values, batch.returns, self.config.value_clip)
        (self.config.value_weight * loss).backward()
        return {"value_loss": loss.detach()}

    def _adapt_learning_rate(self, kl: float) -> None:
        rate = adapted_learning_rate(self.current_learning_rate, kl, self.config.desired_kl)
        self.current_learning_rate = rate
        # A second group is the critic's, whose rate is constant.
        self.policy.optimizer.param_groups[0]["lr"] = rate

    def _split_optimizer(self, critic_rate: float) -> None:
        policy = self.policy
        critic = [*policy.mlp_extractor.critic.parameters(), *policy.value_net.parameters()]
        group = policy.optimizer.param_groups[0]
        members = {id(p) for p in critic}
        group["params"] = [p for p in group["params"] if id(p) not in members]
        policy.optimizer.add_param_group({"params": critic, "lr": critic_rate})


def _take(value: Any, index: Tensor) -> Any:
    if isinstance(value, dict):
        return {key: tensor[index] for key, tensor in value.items()}
    return value[index]


def _value_loss(values: Tensor, old_values: Tensor, returns: Tensor, clip: float) -> Tensor:
    loss = (values - returns) ** 2
    if clip:
        clipped = old_values + (values - old_values).clamp(-clip, clip)
        loss = torch.max(loss, (clipped - returns) ** 2)
    return loss.mean()


def _gaussian_kl(mean: Tensor, std: Tensor, new_mean: Tensor, new_std: Tensor) -> Tensor:
    """Mean over samples of KL(old ‖ new) of diagonal Gaussians."""
    terms = torch.log(new_std / std) + (std**2 + (mean - new_mean) ** 2) / (2.0 * new_std**2) - 0.5
    return terms.sum(dim=-1).mean()
