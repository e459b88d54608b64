"""What a robot is: one frozen description that every other package reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from omni_envs.errors import FileFormatError, InvalidDataError

KEYPOINTS = (
    "pelvis",
    "left_hip", "left_knee", "left_ankle", "left_toe",
    "right_hip", "right_knee", "right_ankle", "right_toe",
    "left_shoulder", "left_elbow", "left_hand",
    "right_shoulder", "right_elbow", "right_hand",
)  # fmt: skip
"""The 15 keypoints that human and robot share, in the order of every (…, 15, 3) array."""

CONTACT_LINKS = (
    "left_hand", "right_hand",
    "left_foot", "right_foot",
    "left_knee", "right_knee",
)  # fmt: skip
"""Semantic names of the links whose contact with object or terrain is scheduled."""

SIDES = ("left", "right")


@dataclass(frozen=True)
class BodyPoint:
    """A point fixed to a body: body name and offset in the body frame (m)."""

    body: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Actuator:
    """A position-controlled joint: τ = kp (q_target - q) - kd q̇, saturated at the effort limit.

    Attributes:
        joint: Hinge joint name in the MJCF.
        stiffness: kp, N m / rad.
        damping: kd, N m s / rad.
        effort: Torque limit, N m.
        velocity_limit: Speed limit, rad/s.
        armature: Reflected rotor inertia, kg m².
    """

    joint: str
    stiffness: float
    damping: float
    effort: float
    velocity_limit: float
    armature: float

    def __post_init__(self) -> None:
        for what in ("stiffness", "effort", "velocity_limit"):
            value = getattr(self, what)
            if not 0.0 < value < np.inf:
                raise InvalidDataError(f"Actuator {self.joint!r}", what, "positive", repr(value))
        for what in ("damping", "armature"):
            value = getattr(self, what)
            if not 0.0 <= value < np.inf:
                raise InvalidDataError(f"Actuator {self.joint!r}", what, "0 or more", repr(value))

    @property
    def action_scale(self) -> float:
        """Radians of target offset per unit of action: 0.25 · effort / kp."""
        return 0.25 * self.effort / self.stiffness


@dataclass(frozen=True)
class Foot:
    """A foot: its body and the points of its sole.

    Attributes:
        body: Body that carries the sole.
        sole: (K, 3) points on the sole plane, body frame, m: the corners first, the toe tip last.
    """

    body: str
    sole: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        if len(self.sole) < 4 or any(len(p) != 3 for p in self.sole):
            raise InvalidDataError(
                f"Foot {self.body!r}", "sole", "at least 3 corners and the toe tip", repr(self.sole)
            )


@dataclass(frozen=True, eq=False)
class Robot:
    """A humanoid robot.

    Joint arrays are in MuJoCo model order: free joint first (position, quaternion wxyz), then
    hinges.

    Attributes:
        name: Short lower-case name, e.g. ``"g1"``.
        title: Name for people, e.g. ``"Unitree G1"``.
        mjcf: Path of the MJCF file. Geom groups: 2 looks only, 3 collides always, 4 collides in
            kinematics (retargeting, metrics) only, 5 collides in physics only.
        height: Standing height, m; a human of height h is scaled by ``height / h``.
        root_body: Body of the free joint.
        anchor_body: Body that anchors the tracking reward (``paper`` preset).
        torso_body: Body whose centre of mass is randomized; anchor of the ``beyondmimic`` preset.
        actuators: One per hinge, in model order.
        default_root_height: Root z of the default pose above flat ground, m.
        default_joint_positions: Joint name to rad, joints not named are 0.
        keypoints: One body point for every name in ``KEYPOINTS``.
        feet: ``"left"`` and ``"right"`` foot.
        contact_links: For every name in ``CONTACT_LINKS`` the bodies that count as that link.
        tracked_bodies: Bodies of the body-tracking rewards.
        end_effectors: Bodies of the end-effector termination.
        reference_ranges: Joint name to (low, high) rad, narrower than the MJCF, for references.
        posture_weights: Joint name to weight of the posture cost w · q² in retargeting.
    """

    name: str
    title: str
    mjcf: Path
    height: float
    root_body: str
    anchor_body: str
    torso_body: str
    actuators: tuple[Actuator, ...]
    default_root_height: float
    default_joint_positions: Mapping[str, float]
    keypoints: Mapping[str, BodyPoint]
    feet: Mapping[str, Foot]
    contact_links: Mapping[str, tuple[str, ...]]
    tracked_bodies: tuple[str, ...]
    end_effectors: tuple[str, ...]
    reference_ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    posture_weights: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for what, table, names in (
            ("keypoints", self.keypoints, KEYPOINTS),
            ("feet", self.feet, SIDES),
            ("contact_links", self.contact_links, CONTACT_LINKS),
        ):
            missing = [n for n in names if n not in table]
            if missing:
                raise self._invalid(what, f"a table with {', '.join(names)}", f"no {missing}")
        joints = self.joint_names
        repeated = sorted({j for j in joints if joints.count(j) > 1})
        if repeated:
            raise self._invalid("actuators", "one per hinge", f"several for {repeated}")
        for what, values in (
            ("default_joint_positions", self.default_joint_positions),
            ("reference_ranges", self.reference_ranges),
            ("posture_weights", self.posture_weights),
        ):
            unknown = [j for j in values if j not in joints]
            if unknown:
                raise self._invalid(what, "a table over the actuated joints", f"unknown {unknown}")
        for name, (low, high) in self.reference_ranges.items():
            if not low < high:
                raise self._invalid("reference_ranges", "low < high", f"{name}: ({low}, {high})")

    def _invalid(self, field: str, expected: str, found: str) -> InvalidDataError:
        return InvalidDataError(f"Robot {self.name!r}", field, expected, found)

    def spec(self) -> mujoco.MjSpec:
        """Returns a fresh, editable specification of the robot alone, with actuators and armature.

        Raises:
            FileFormatError: The MJCF is missing or MuJoCo cannot read it.
            InvalidDataError: The MJCF's joints are not one free joint and then the hinges of
                ``actuators`` in that order, or it lacks a body that this description names.
        """
        if not self.mjcf.is_file():
            raise FileFormatError(self.mjcf, "file", "an existing MJCF file", "nothing")
        try:
            spec = mujoco.MjSpec.from_file(str(self.mjcf))
        except ValueError as error:
            raise FileFormatError(self.mjcf, "MJCF", "what MuJoCo reads", str(error)) from error
        self._check(spec)
        for a in self.actuators:
            spec.joint(a.joint).armature = a.armature
            actuator = spec.add_actuator(name=a.joint, target=a.joint)
            actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
            actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
            actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
            actuator.gainprm[0] = a.stiffness
            actuator.biasprm[:3] = 0.0, -a.stiffness, -a.damping
            actuator.forcelimited = True
            actuator.forcerange = -a.effort, a.effort
        return spec

    def _check(self, spec: mujoco.MjSpec) -> None:
        """Holds the description against the file: joints in order, every named body there."""
        named = {self.root_body, self.anchor_body, self.torso_body}
        named.update(self.tracked_bodies, self.end_effectors, *self.contact_links.values())
        named.update(point.body for point in self.keypoints.values())
        named.update(foot.body for foot in self.feet.values())
        missing = sorted(named - {b.name for b in spec.bodies})
        if missing:
            raise self._invalid("bodies", f"bodies of {self.mjcf.name}", f"unknown {missing}")
        free, hinge = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_HINGE)
        types = [int(j.type) for j in spec.joints]
        names = tuple(j.name for j in spec.joints[1:])
        if types != [free] + [hinge] * self.num_joints or names != self.joint_names:
            expected = f"the hinges of {self.mjcf.name} after its free joint, {names}"
            raise self._invalid("actuators", expected, f"{self.joint_names}")
        root = spec.joints[0].parent.name
        if root != self.root_body:
            raise self._invalid("root_body", f"{root!r}, which is free", repr(self.root_body))

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled robot alone. Shared: do not write to it."""
        return self.spec().compile()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Hinge names in model order."""
        return tuple(a.joint for a in self.actuators)

    @property
    def num_joints(self) -> int:
        """Number of hinges."""
        return len(self.actuators)

    @property
    def nq(self) -> int:
        """Length of the robot's qpos: 7 + hinges."""
        return 7 + self.num_joints

    @property
    def nv(self) -> int:
        """Length of the robot's qvel: 6 + hinges."""
        return 6 + self.num_joints

    @cached_property
    def body_names(self) -> tuple[str, ...]:
        """All bodies of the robot in model order, the world left out."""
        return tuple(self.model.body(i).name for i in range(1, self.model.nbody))

    @cached_property
    def default_joint_array(self) -> np.ndarray:
        """(n,) default joint positions, rad."""
        return np.array([self.default_joint_positions.get(j, 0.0) for j in self.joint_names])

    @cached_property
    def default_qpos(self) -> np.ndarray:
        """(nq,) default pose standing at the origin, facing +x."""
        root = [0.0, 0.0, self.default_root_height, 1.0, 0.0, 0.0, 0.0]
        return np.concatenate([root, self.default_joint_array])

    @cached_property
    def joint_ranges(self) -> np.ndarray:
        """(n, 2) mechanical joint ranges of the MJCF, rad."""
        return np.array([self.model.joint(j).range for j in self.joint_names])

    @cached_property
    def reference_joint_ranges(self) -> np.ndarray:
        """(n, 2) joint ranges of references, rad: ``joint_ranges`` cut by ``reference_ranges``."""
        ranges = self.joint_ranges.copy()
        for name, (low, high) in self.reference_ranges.items():
            i = self.joint_names.index(name)
            ranges[i] = max(ranges[i, 0], low), min(ranges[i, 1], high)
        return ranges

    @cached_property
    def velocity_limits(self) -> np.ndarray:
        """(n,) joint speed limits, rad/s."""
        return np.array([a.velocity_limit for a in self.actuators])

    @cached_property
    def action_scale(self) -> np.ndarray:
        """(n,) rad per unit of action."""
        return np.array([a.action_scale for a in self.actuators])
