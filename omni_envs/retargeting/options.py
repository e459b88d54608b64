"""Settings of the retargeter. Every default says where it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Literal

from omni_envs.errors import InvalidOptionError

Solver = Literal["daqp", "clarabel"]
Backend = Literal["mink", "placo"]
StanceMode = Literal["text", "default", "code"]

ORIENTED = ("pelvis", "torso", "shin", "foot", "forearm", "hand")
"""Links whose orientation may be matched."""


def _require(ok: bool, name: str, expected: str, found: object) -> None:
    if not ok:
        raise InvalidOptionError(f"RetargetOptions: {name} must be {expected}; got {found!r}.")


@dataclass(frozen=True)
class StanceOptions:
    """How planted feet are held.

    Attributes:
        anchored: Stance set in which the whole sole stays where it was at the start of the
            interval. None anchors nothing.
        tolerance: Half width of the window of an anchored toe tip, m.
        heart_tolerance: Half width of the window of the heart of an anchored sole about the toe
            tip, m: room for some 8° of roll.
        loose: Wider stance set in which the sole may move slowly. None leaves it free.
        loose_speed: Largest speed of a sole point in the loose set, m/s.
    """

    anchored: StanceMode | None = "default"
    tolerance: float = 1e-4
    heart_tolerance: float = 0.8e-3
    loose: StanceMode | None = "code"
    loose_speed: float = 0.06

    def __post_init__(self) -> None:
        for name in ("anchored", "loose"):
            mode = getattr(self, name)
            _require(
                mode in (None, "text", "default", "code"), name, "text, default, code or None", mode
            )
        _require(self.tolerance > 0, "stance.tolerance", "positive (m)", self.tolerance)
        _require(self.loose_speed > 0, "stance.loose_speed", "positive (m/s)", self.loose_speed)


@dataclass(frozen=True)
class RetargetOptions:
    """Settings of ``retarget``.

    Attributes:
        surface_points: Points on object or terrain in the interaction mesh (OmniRetarget: 100).
        ground_points: Most points of the ground beside terrain that are in the mesh, too. They
            tell a swinging foot where the ground is before it lands. (OmniRetarget's climbs: none.)
        laplacian_weight: Weight of the deformation energy (OmniRetarget: 10).
        smoothness_weight: Weight of the distance to the previous frame (OmniRetarget: 0.2).
        contact_weight: Weight of the distance between a touching link and the point of the surface
            that the human touches (see ``ContactTask``), 0 switches it off. Not in the paper.
        sole_weight: Weight of the distance between a sole and the support that the human has the
            whole sole on, 0 switches it off. Not in the paper.
        nominal_weight: Weight of base and legs against a nominal motion, where ``retarget`` is
            given one (OmniRetarget: 5).
        nominal_decay: Time in which that weight falls to 1/e, s (OmniRetarget: 10 frames at 30 fps
            where the object was changed); None keeps it (where the terrain was).
        orientation_weights: Name in ``ORIENTED`` to the weight, per rad², of the turn between the
            human link and the robot's: 0.1 to 1 shows beside the mesh. None by default: not in the
            paper's experiments.
        trust_region: Radius of one step in the metric S, where ‖δquaternion‖ counts (OmniRetarget:
            0.2).
        iterations: Most steps per frame (OmniRetarget: 10).
        first_iterations: Most steps on the first frame (OmniRetarget: 50).
        convergence: Stop when the predicted cost changes relatively less. 1e-3 halves the steps of
            the official 1e-5 and costs 0.01 % of energy.
        penetration_tolerance: Depth that counts as no penetration, m (OmniRetarget: 1e-3).
        contact_distance: Pairs of robot and surroundings closer than this are constrained, m.
        self_collision: Keep the robot's own bodies apart.
        self_distance: Pairs of robot bodies closer than this are constrained, m.
        stance: How planted feet are held.
        velocity_limits: Fraction of the actuators' speed limits that a step may use; None is no
            limit.
        restoration_iterations: Most steps that repair what linearisation left violated.
        restoration_tolerance: Violation that needs no repair, m.
        solver: ``"daqp"``, or ``"clarabel"``, which takes the trust region as a second-order cone.
        backend: ``"mink"``, or ``"placo"``: pinocchio's kinematics and placo's QP, to check with.
        refine: Whether references are smoothed as a whole after the frame-by-frame pass: see
            ``refine``.
    """

    surface_points: int = 100
    ground_points: int = 60
    laplacian_weight: float = 10.0
    smoothness_weight: float = 0.2
    contact_weight: float = 4000.0
    sole_weight: float = 1000.0
    nominal_weight: float = 5.0
    nominal_decay: float | None = 1.0 / 3.0
    orientation_weights: Mapping[str, float] = field(default_factory=dict)
    trust_region: float = 0.2
    iterations: int = 10
    first_iterations: int = 50
    convergence: float = 1e-3
    penetration_tolerance: float = 0.0
    contact_distance: float = 0.05
    self_collision: bool = True
    self_distance: float = 0.02
    stance: StanceOptions = field(default_factory=StanceOptions)
    velocity_limits: float | None = 1.0
    restoration_iterations: int = 5
    restoration_tolerance: float = 2e-5
    solver: Solver = "daqp"
    backend: Backend = "mink"
    refine: bool = True

    def __post_init__(self) -> None:
        _require(self.surface_points >= 8, "surface_points", "at least 8", self.surface_points)
        _require(self.ground_points >= 0, "ground_points", "at least 0", self.ground_points)
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name.endswith("_weight") or f.name.endswith("tolerance"):
                _require(value >= 0, f.name, "not negative", value)
        for name in ("trust_region", "convergence", "contact_distance", "self_distance"):
            _require(getattr(self, name) > 0, name, "positive", getattr(self, name))
        for name in ("iterations", "first_iterations"):
            _require(getattr(self, name) >= 1, name, "at least 1", getattr(self, name))
        limits = self.velocity_limits
        _require(limits is None or limits > 0, "velocity_limits", "positive or None", limits)
        for name, weight in self.orientation_weights.items():
            _require(name in ORIENTED, "orientation_weights", f"over {', '.join(ORIENTED)}", name)
            _require(weight >= 0, f"orientation_weights[{name!r}]", "not negative", weight)
        decay = self.nominal_decay
        _require(decay is None or decay > 0, "nominal_decay", "positive (s) or None", decay)
        _require(self.solver in ("daqp", "clarabel"), "solver", "daqp or clarabel", self.solver)
        _require(self.backend in ("mink", "placo"), "backend", "mink or placo", self.backend)
