"""The numbers of the tracking task: frozen dataclasses, presets ``paper`` and ``beyondmimic``.

Every field is an environment option. The presets differ where the text of OmniRetarget
(arXiv 2509.26633) differs from the published code of BeyondMimic (arXiv 2508.08241):

===========================  ==============================  ======================================
field                        ``paper``                       ``beyondmimic``
===========================  ==============================  ======================================
anchor body                  pelvis                          torso
torso centre of mass, z      ±0.075 m                        ±0.05 m
push                         0.3 m/s, 0.78 rad/s per axis    (0.5, 0.5, 0.2) m/s,
                                                             (0.52, 0.52, 0.78) rad/s
robot friction               as modelled                     0.3 … 1.2
anchor position noise        none                            ±0.25 m
contact penalty              self-collision                  any contact but of feet and hands
object randomization         mass, CoM, inertia, shape       none
object termination           1 m or 45°                      none
object reward                position and orientation        none
start frames                 uniform                         adaptive
===========================  ==============================  ======================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from math import pi
from typing import Any, Literal

from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.scenes import PhysicsOptions
from omni_envs.tracking.limits import check_limits
from omni_envs.tracking.options import override

Vector3 = tuple[float, float, float]
Range = tuple[float, float]


@dataclass(frozen=True)
class TrackingTerm:
    """A tracking reward w · exp(-e / σ²).

    Attributes:
        weight: w, reward per second at a perfect match.
        sigma: σ, in the unit of the error.
    """

    weight: float = 1.0
    sigma: float = 1.0


@dataclass(frozen=True)
class RewardConfig:
    """Reward terms; every weight is per second and multiplied by the control step.

    Attributes:
        anchor_position: ‖p_ref - p‖² of the anchor body in the world, m.
        anchor_orientation: Squared angle of the anchor body, rad.
        body_position: Mean over the tracked bodies, re-aligned at the anchor, m.
        body_orientation: Mean over the tracked bodies, re-aligned, rad.
        body_linear_velocity: Mean over the tracked bodies, world frame, m/s.
        body_angular_velocity: Mean over the tracked bodies, world frame, rad/s.
        object_position: Object in the world, m.
        object_orientation: Object in the world, rad.
        action_rate: Weight of Σ (a_t - a_{t-1})², raw actions.
        joint_limit: Weight of the summed excess over the soft joint limits, rad.
        soft_limit: Soft limits: this share of the joint range, about its middle.
        contact: Weight of the contact count.
        contact_rule: ``"self"`` counts bodies with self-collision (OmniRetarget), ``"any"`` bodies
            but feet and hands with any contact (BeyondMimic), ``"substeps"`` physics steps with
            self-collision of any body (mjlab).
        may_touch: Links whose contacts the rule ``"any"`` does not count. Tasks that lean on their
            knees add these.
        contact_force: Smallest force that counts, N.
        no_orientation: Bodies left out of the orientation term (the ankles, for a wall flip).
    """

    anchor_position: TrackingTerm = TrackingTerm(0.5, 0.3)
    anchor_orientation: TrackingTerm = TrackingTerm(0.5, 0.4)
    body_position: TrackingTerm = TrackingTerm(1.0, 0.3)
    body_orientation: TrackingTerm = TrackingTerm(1.0, 0.4)
    body_linear_velocity: TrackingTerm = TrackingTerm(1.0, 1.0)
    body_angular_velocity: TrackingTerm = TrackingTerm(1.0, 3.14)
    object_position: TrackingTerm | None = TrackingTerm(1.0, 0.3)
    object_orientation: TrackingTerm | None = TrackingTerm(1.0, 0.4)
    action_rate: float = -0.1
    joint_limit: float = -10.0
    soft_limit: float = 0.9
    contact: float = -0.1
    contact_rule: Literal["self", "any", "substeps"] = "self"
    may_touch: tuple[str, ...] = ("left_hand", "right_hand", "left_foot", "right_foot")
    contact_force: float = 1.0
    no_orientation: tuple[str, ...] = ()


@dataclass(frozen=True)
class TerminationConfig:
    """What ends an episode; None switches a test off.

    Attributes:
        anchor_height: |Δz| of the anchor body, m.
        anchor_tilt: Difference of the z parts of projected gravity of the anchor body, no unit.
        end_effector_height: |Δz| of any end effector, m (0.5 for a wall flip).
        object_position: Distance of the object from its reference, m.
        object_angle: Angle of the object to its reference, rad.
        object_after: The object tests wait until the body is tracked reasonably: until the latest
            hundred episodes lasted this share of what they could have, once; 0 does not wait.
        max_seconds: Time-out (a truncation), s.
    """

    anchor_height: float | None = 0.25
    anchor_tilt: float | None = 0.8
    end_effector_height: float | None = 0.25
    object_position: float | None = 1.0
    object_angle: float | None = pi / 4
    object_after: float = 0.5
    max_seconds: float | None = 10.0


@dataclass(frozen=True)
class ObservationNoise:
    """Half widths of the uniform noise on the policy's observation.

    Attributes:
        anchor_position: m.
        anchor_orientation: On the six matrix entries.
        base_linear_velocity: m/s.
        base_angular_velocity: rad/s.
        joint_position: rad.
        joint_velocity: rad/s.
    """

    anchor_position: float = 0.0
    anchor_orientation: float = 0.05
    base_linear_velocity: float = 0.5
    base_angular_velocity: float = 0.2
    joint_position: float = 0.01
    joint_velocity: float = 0.5


@dataclass(frozen=True)
class ObservationConfig:
    """What the policy, and a privileged critic, see.

    Attributes:
        state_estimation: With the anchor's position error and the base's linear velocity, which a
            robot has to estimate. Without, both terms are absent.
        privileged: Observations are ``{"policy": …, "critic": …}``; the critic's have no noise.
        noise: Noise on the policy's observation, or None.
    """

    state_estimation: bool = True
    privileged: bool = False
    noise: ObservationNoise | None = ObservationNoise()


@dataclass(frozen=True)
class PushConfig:
    """Random pushes: velocity added to the free joint, uniform ± per axis, in the world frame.

    Attributes:
        interval: Shortest and longest time between two pushes, s.
        linear: m/s.
        angular: rad/s.
    """

    interval: Range = (1.0, 3.0)
    linear: Vector3 = (0.3, 0.3, 0.3)
    angular: Vector3 = (0.78, 0.78, 0.78)


@dataclass(frozen=True)
class ObjectRandomization:
    """Randomization of the object; None switches a part off.

    Attributes:
        mass: Smallest and largest mass, kg.
        centre_of_mass: ± per axis, m.
        inertia: Smallest and largest factor on the whole inertia tensor.
        shape: ± share of the size: per axis for a box, of the whole for other shapes.
    """

    mass: Range | None = (0.1, 2.0)
    centre_of_mass: float = 0.08
    inertia: Range | None = (0.5, 1.5)
    shape: float = 0.1


@dataclass(frozen=True)
class RandomizationConfig:
    """What differs between episodes; None switches a part off.

    Attributes:
        torso_centre_of_mass: ± per axis, m.
        joint_default: ± on the default joint positions, which action and observation count from,
            rad.
        friction: Smallest and largest sliding friction of the robot's contacts.
        push: Random pushes.
        object: Object properties.
        variants: Number of randomized models that episodes draw from.
        seed: Of these models, apart from the environment's own: environments with the same seed
            draw from the same ones. Policies are evaluated on others than they were trained on.
    """

    torso_centre_of_mass: Vector3 | None = (0.025, 0.05, 0.075)
    joint_default: float = 0.01
    friction: Range | None = None
    push: PushConfig | None = PushConfig()
    object: ObjectRandomization | None = ObjectRandomization()
    variants: int = 128
    seed: int = 0


@dataclass(frozen=True)
class ResetNoise:
    """Half widths of the uniform noise on the start state.

    Attributes:
        root_position: m.
        root_orientation: Roll, pitch, yaw about the world's axes, rad.
        root_linear_velocity: m/s.
        root_angular_velocity: World axes, rad/s.
        joint_position: rad; clipped to the soft limits.
        object_position: m.
    """

    root_position: Vector3 = (0.05, 0.05, 0.01)
    root_orientation: Vector3 = (0.1, 0.1, 0.2)
    root_linear_velocity: Vector3 = (0.5, 0.5, 0.2)
    root_angular_velocity: Vector3 = (0.52, 0.52, 0.78)
    joint_position: float = 0.1
    object_position: Vector3 = (0.05, 0.05, 0.0)


@dataclass(frozen=True)
class AdaptiveSampling:
    """Start frames where episodes fail: bins of about a second, weighted by their failures.

    Attributes:
        uniform: Failure count that every bin starts from, shared by all bins.
        decay: Share of the old failure average that a control step keeps: 1 - 0.001.
        kernel: Bins that a failure is spread over, backwards in time; 1 does not spread.
        kernel_decay: Weight of the next earlier bin.
    """

    uniform: float = 0.1
    decay: float = 0.999
    kernel: int = 1
    kernel_decay: float = 0.8


@dataclass(frozen=True)
class NoiseGrowth:
    """Start noise that grows with what the policy can do, for training.

    Noise has a level between 0 and 1, at first 0; an episode starts with the level times √u of the
    whole noise, u uniform in [0, 1). Whenever a hundred episodes are over, the level moves up by a
    step if they lasted long enough, else down.

    Attributes:
        share: Long enough: this share of what they could have lasted, together.
        step: How far the level moves.
        observation: The noise on the policy's observation grows, too: it is the level times the
            whole.
    """

    share: float = 0.5
    step: float = 0.02
    observation: bool = False


@dataclass(frozen=True)
class ResetConfig:
    """Where episodes start.

    Attributes:
        start: ``"uniform"`` over all frames, ``"start"`` of a motion, or ``"adaptive"``.
        start_share: Share of the episodes that start at the first frame of a motion whatever
            ``start`` says: a policy is judged by those (0.2 in one release of holosoma).
        noise: Noise on the start state, or None.
        growth: How the noise grows in training, or None: all of it from the first episode on.
        adaptive: How adaptive sampling weighs failures.
    """

    start: Literal["uniform", "start", "adaptive"] = "uniform"
    start_share: float = 0.0
    noise: ResetNoise | None = ResetNoise()
    growth: NoiseGrowth | None = None
    adaptive: AdaptiveSampling = AdaptiveSampling()


@dataclass(frozen=True)
class ActionConfig:
    """What an action means: joint target = offset + scale · a, scale = 0.25 · effort / kp.

    Attributes:
        mode: The offset: ``"default"`` pose, ``"residual"``: the reference's joint positions, or
            ``"feedforward"``: positions ahead of those by what damping and load will hold the joint
            back (see ``omni_envs.tracking.feedforward``), so that the policy only has to balance.
            Only what is passed to ``step`` differs: rewards and the observed previous action are
            about the action that gives the same target from the default pose, in all modes.
        limit: Actions are clipped to ± this.
        scale: Factor on the scale of the robot.
    """

    mode: Literal["default", "residual", "feedforward"] = "default"
    limit: float = 10.0
    scale: float = 1.0


@dataclass(frozen=True)
class PhysicsConfig:
    """Physics of a control step.

    Attributes:
        timestep: Physics step, s.
        substeps: Physics steps per control step.
        integrator: ``"implicitfast"``, ``"discrete"`` or ``"euler"``.
        iterations: Newton iterations at most.
        ls_iterations: Line-search iterations at most.
    """

    timestep: float = 0.005
    substeps: int = 4
    integrator: Literal["implicitfast", "discrete", "euler"] = "implicitfast"
    iterations: int = 10
    ls_iterations: int = 20

    def __post_init__(self) -> None:
        if not self.timestep > 0 or self.substeps < 1:
            raise InvalidOptionError("physics: timestep and substeps must be positive.")
        if self.iterations < 5:
            raise InvalidOptionError("physics: fewer than 5 iterations are unstable.")

    @property
    def control_step(self) -> float:
        """Time between two actions, s."""
        return self.timestep * self.substeps

    @property
    def options(self) -> PhysicsOptions:
        """The part that belongs to the compiled model."""
        return PhysicsOptions(self.timestep, self.integrator, self.iterations, self.ls_iterations)


PHYSICS_PRESETS = {
    "default": PhysicsConfig(),
    "fast": PhysicsConfig(timestep=0.01, substeps=2, integrator="discrete"),
}
"""``"default"``: 4 × 5 ms; ``"fast"``: 2 × 10 ms, for training only."""


@dataclass(frozen=True)
class TrackingConfig:
    """The whole task.

    Attributes:
        anchor: Body that anchors the comparison: ``"pelvis"`` or ``"torso"`` of the robot.
        reward: Reward terms.
        termination: What ends an episode.
        observation: What the policy sees.
        randomization: What differs between episodes.
        reset: Where episodes start.
        action: What an action means.
        physics: Physics settings.
    """

    anchor: Literal["pelvis", "torso"] = "pelvis"
    reward: RewardConfig = field(default_factory=RewardConfig)
    termination: TerminationConfig = field(default_factory=TerminationConfig)
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    randomization: RandomizationConfig = field(default_factory=RandomizationConfig)
    reset: ResetConfig = field(default_factory=ResetConfig)
    action: ActionConfig = field(default_factory=ActionConfig)
    physics: PhysicsConfig = field(default_factory=PhysicsConfig)


_PAPER = TrackingConfig()
PRESETS: Mapping[str, TrackingConfig] = {
    "paper": _PAPER,
    "beyondmimic": replace(
        _PAPER,
        anchor="torso",
        reward=RewardConfig(contact_rule="any", object_position=None, object_orientation=None),
        termination=TerminationConfig(object_position=None, object_angle=None),
        observation=ObservationConfig(noise=ObservationNoise(anchor_position=0.25)),
        randomization=RandomizationConfig(
            torso_centre_of_mass=(0.025, 0.05, 0.05),
            friction=(0.3, 1.2),
            push=PushConfig(linear=(0.5, 0.5, 0.2), angular=(0.52, 0.52, 0.78)),
            object=None,
        ),
        reset=ResetConfig(start="adaptive"),
    ),
}
"""Name to task."""

OPTIONS = tuple(f.name for f in fields(TrackingConfig))
"""Names of the option groups."""


def make_config(
    preset: str = "paper", task: Mapping[str, Any] | None = None, **options: Any
) -> TrackingConfig:
    """Builds a task from a preset and options.

    Args:
        preset: A name of ``PRESETS``.
        task: What the task changes in the preset, before the options.
        **options: Fields of ``TrackingConfig``: dataclasses, mappings of what differs from
            the preset,
            or None for no difference. ``physics`` may be a name of ``PHYSICS_PRESETS`` too.

    Raises:
        UnknownNameError: A preset or field that does not exist.
        InvalidOptionError: A value of the wrong type or size, or outside its limits.
    """
    if preset not in PRESETS:
        raise UnknownNameError("preset", preset, PRESETS)
    given = {name: value for name, value in options.items() if value is not None}
    physics = given.get("physics")
    if isinstance(physics, str):
        if physics not in PHYSICS_PRESETS:
            raise UnknownNameError("physics preset", physics, PHYSICS_PRESETS)
        given["physics"] = PHYSICS_PRESETS[physics]
    config = override(override(PRESETS[preset], task, "task"), given, "environment")
    check_limits(config)
    return config
