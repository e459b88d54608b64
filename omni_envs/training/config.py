"""What a training run is: one frozen description that is saved beside its results."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.training.checks import known, positive, whole_number, within

CONFIG_FILE = "config.json"
TRAINERS = ("sb3", "torchrl")
DEVICES = ("auto", "cpu", "cuda")
PRIVILEGED: Mapping[str, Any] = {"observation": {"privileged": True}}
"""Training options of an asymmetric critic."""


@dataclass(frozen=True)
class PPOConfig:
    """Hyper-parameters of PPO; the defaults are BeyondMimic's (rsl_rl).

    Attributes:
        rollout_steps: Control steps per environment between two updates.
        epochs: Passes over a rollout.
        minibatches: Gradient steps per pass.
        learning_rate: Initial learning rate of Adam.
        critic_learning_rate: Constant learning rate of the critic; 0 gives it the actor's. With
            small rollouts the divergence asks for an actor so slow that the critic lags behind.
        desired_kl: The learning rate is divided by 1.5 where an update moves the policy by more
            than twice this KL divergence, multiplied where by less than half; 0 keeps it constant.
        adapt_every: How often that happens: after every ``"minibatch"`` (rsl_rl), or every
            ``"update"``, by the divergence of its last epoch: in small rollouts the divergence only
            grows from one mini-batch to the next, and the former swings between too fast and too
            slow within every update.
        gamma: Discount per control step.
        gae_lambda: λ of generalised advantage estimation.
        clip: Clipping range of the probability ratio.
        value_clip: Clipping range of the value, in units of return; 0 does not clip.
        value_weight: Weight of the value loss.
        entropy_weight: Weight of the entropy bonus.
        action_weight: Weight of ‖μ‖², the squared mean action summed over the joints: keeps a
            policy near what its action mode does by itself.
        max_grad_norm: Largest norm of the gradient.
        hidden: Widths of the hidden layers, of actor and critic alike.
        initial_std: Standard deviation of the exploration noise at the start, in units of action; a
            run that goes on with another one starts again from that.
        average_updates: Updates that the policy's weights are averaged over for evaluation and
            export; 0 takes the newest. Training goes on from the newest either way.
    """

    rollout_steps: int = 24
    epochs: int = 5
    minibatches: int = 4
    learning_rate: float = 1e-3
    critic_learning_rate: float = 0.0
    desired_kl: float = 0.01
    adapt_every: Literal["minibatch", "update"] = "minibatch"
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip: float = 0.2
    value_clip: float = 0.2
    value_weight: float = 1.0
    entropy_weight: float = 0.005
    action_weight: float = 0.0
    max_grad_norm: float = 1.0
    hidden: tuple[int, ...] = (512, 256, 128)
    initial_std: float = 1.0
    average_updates: int = 0

    def __post_init__(self) -> None:
        for name, least in _WHOLE.items():
            expected = f"a whole number from {least} on"
            within("PPOConfig", name, getattr(self, name), expected, least, whole=True)
        for name in ("learning_rate", "initial_std", "clip", "max_grad_norm"):
            positive("PPOConfig", name, getattr(self, name))
        for name in _FROM_ZERO:
            within("PPOConfig", name, getattr(self, name), "0 or more", 0.0)
        for name in ("gamma", "gae_lambda"):
            within("PPOConfig", name, getattr(self, name), "from 0 to 1", 0.0, 1.0)
        if self.adapt_every not in ("minibatch", "update"):
            raise InvalidOptionError(
                f"PPOConfig: adapt_every must be 'minibatch' or 'update'; got {self.adapt_every!r}."
            )
        widths = self.hidden
        if (
            not isinstance(widths, tuple)
            or not widths
            or any(not whole_number(w, 1) for w in widths)
        ):
            raise InvalidOptionError(f"PPOConfig: hidden must be widths ≥ 1; got {self.hidden}.")


@dataclass(frozen=True)
class TrainConfig:
    """A training run.

    Attributes:
        env: Environment id.
        out: Run directory; everything the run makes lies in it.
        steps: Control steps to train for, all environments together.
        trainer: Library that trains.
        num_envs: Simulations.
        num_threads: Physics threads; 0 takes every core.
        seed: Seed of the network, the exploration and the environment.
        device: Where the network learns: ``"cpu"``, ``"cuda"``, or ``"auto"``, a GPU where there is
            one. Physics is on the CPU. Runs with the same seed are the same to the bit on the CPU.
        env_options: Options of the environment, as ``gymnasium.make`` takes them, JSON-compatible:
            the task that the policy is for, and is evaluated on. A reference that lies in the run
            directory may be named relative to it in ``config.json``.
        training_options: Options over those in training alone: what helps to learn, such as a
            privileged critic, ``"fast"`` physics or less noise.
        time_limit: Seconds after which training ends before ``steps`` are reached; 0 = no limit.
        checkpoint_every: Updates between two checkpoints.
        evaluation_episodes: Episodes of the evaluation.
        ppo: Hyper-parameters.
        start_from: Run directory or published policy whose networks this run begins with, to
            fine-tune them, e.g. on another motion; empty for new networks. Steps count from 0, the
            optimiser knows nothing yet, and exploration begins with ``ppo.initial_std``.
    """

    env: str
    out: Path
    steps: int
    trainer: Literal["sb3", "torchrl"] = "sb3"
    num_envs: int = 256
    num_threads: int = 0
    seed: int = 0
    device: Literal["auto", "cpu", "cuda"] = "cpu"
    env_options: Mapping[str, Any] = field(default_factory=dict)
    training_options: Mapping[str, Any] = field(default_factory=lambda: PRIVILEGED)
    time_limit: float = 0.0
    checkpoint_every: int = 50
    evaluation_episodes: int = 100
    ppo: PPOConfig = field(default_factory=PPOConfig)
    start_from: str = ""

    def __post_init__(self) -> None:
        for name in ("steps", "num_envs", "checkpoint_every", "evaluation_episodes"):
            positive("TrainConfig", name, getattr(self, name))
        for name in ("num_threads", "seed", "time_limit"):
            within("TrainConfig", name, getattr(self, name), "0 or more", 0.0)
        if self.trainer not in TRAINERS:
            raise InvalidOptionError(
                f"TrainConfig: trainer must be 'sb3' or 'torchrl'; got {self.trainer!r}."
            )
        if self.device not in DEVICES:
            raise InvalidOptionError(
                f"TrainConfig: device must be 'auto', 'cpu' or 'cuda'; got {self.device!r}."
            )
        if not isinstance(self.start_from, str):
            raise InvalidOptionError(
                f"TrainConfig: start_from must be a path as text; got {self.start_from!r}."
            )
        object.__setattr__(self, "out", Path(self.out))
        for name in ("env_options", "training_options"):
            try:
                object.__setattr__(self, name, json.loads(json.dumps(dict(getattr(self, name)))))
            except (TypeError, ValueError) as error:
                raise InvalidOptionError(
                    f"TrainConfig: {name} must be a JSON-compatible mapping ({error})."
                ) from error

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON-compatible data; ``from_dict`` is its inverse."""
        data = asdict(self)
        data["out"] = str(self.out)
        data["ppo"]["hidden"] = list(self.ppo.hidden)
        return data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TrainConfig:
        """Rebuilds a configuration from ``to_dict``.

        Raises:
            InvalidOptionError: A field is unknown, missing or not allowed.
        """
        known("TrainConfig", data, cls)
        ppo = dict(data.get("ppo", {}))
        known("TrainConfig.ppo", ppo, PPOConfig)
        if "hidden" in ppo:
            widths = ppo["hidden"]
            ppo["hidden"] = tuple(widths) if isinstance(widths, list | tuple) else widths
        try:
            return cls(**{**data, "ppo": PPOConfig(**ppo)})
        except TypeError as error:
            raise InvalidOptionError(f"TrainConfig: {error}.") from error

    def command(self, before: TrainConfig | None = None) -> str:
        """Returns the command that repeats this run: a recipe, and what differs from it.

        Args:
            before: Settings of the run up to here, which this one goes on with.
        """
        from omni_envs.training.command import command, command_to_go_on

        return command(self) if before is None else command_to_go_on(before, self)

    def save(self, run: Path | None = None) -> Path:
        """Writes ``config.json`` into a run directory, by default its own."""
        path = (self.out if run is None else run) / CONFIG_FILE
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(self.to_dict(), indent=2) + "\n")
        return path

    @classmethod
    def load(cls, run: str | Path) -> TrainConfig:
        """Reads the configuration of a run directory, which may have been moved.

        Raises:
            FileFormatError: There is none, or it is damaged.
        """
        path = Path(run) / CONFIG_FILE
        if not path.is_file():
            raise FileFormatError(path, "file", "the configuration of a training run", "nothing")
        try:
            data = json.loads(path.read_text())
            options = _beside(Path(run), data["env_options"]) if "env_options" in data else {}
            return cls.from_dict({**data, "out": Path(run), "env_options": options})
        except (ValueError, TypeError) as error:
            raise FileFormatError(path, "content", "a TrainConfig as JSON", str(error)) from error


_WHOLE = {"rollout_steps": 1, "epochs": 1, "minibatches": 1, "average_updates": 0}
_FROM_ZERO = (
    "critic_learning_rate", "desired_kl", "value_clip", "value_weight", "entropy_weight",
    "action_weight",
)  # fmt: skip


def merged(options: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Returns environment options with changes: two mappings are merged field by field."""
    result = dict(options)
    for name, change in changes.items():
        old = result.get(name)
        both = isinstance(old, Mapping) and isinstance(change, Mapping)
        result[name] = {**old, **change} if both else change  # type: ignore[dict-item]
    return result


def _beside(run: Path, options: Mapping[str, Any]) -> Mapping[str, Any]:
    """Returns options with the references that lie in a run directory named from here."""

    def placed(name: Any) -> Any:
        inside = isinstance(name, str) and not Path(name).is_absolute() and (run / name).is_file()
        return str(run / name) if inside else name

    reference = options.get("reference")
    if reference is None:
        return options
    several = isinstance(reference, list)
    return {**options, "reference": [*map(placed, reference)] if several else placed(reference)}
