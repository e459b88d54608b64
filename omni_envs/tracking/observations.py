"""Observations: an explicit, ordered list of terms with names and slices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from omni_envs.tracking import quaternion
from omni_envs.tracking.alignment import Bodies
from omni_envs.tracking.array_api import Array, array_namespace
from omni_envs.tracking.config import ObservationConfig, ObservationNoise


class ObservedState(NamedTuple):
    """What observations are computed from, for N simulations.

    Attributes:
        reference_joint_position: (N, n) of the frame to track, rad.
        reference_joint_velocity: (N, n) rad/s.
        reference_anchor_position: (N, 3) m.
        reference_anchor_quaternion: (N, 4).
        anchor_position: (N, 3) of the robot, m.
        anchor_quaternion: (N, 4) of the robot.
        base_quaternion: (N, 4) of the robot's root body.
        base_linear_velocity: (N, 3) of the root body in the world, m/s.
        base_angular_velocity: (N, 3) of the root body in its own frame, rad/s.
        joint_position: (N, n) relative to the default position, rad.
        joint_velocity: (N, n) rad/s.
        action: (N, n) the previous action.
        bodies: The tracked bodies, for the critic.
        object_pose: (N, 7) or None, for the critic.
        object_linear_velocity: (N, 3) in the world or None, for the critic.
    """

    reference_joint_position: Array
    reference_joint_velocity: Array
    reference_anchor_position: Array
    reference_anchor_quaternion: Array
    anchor_position: Array
    anchor_quaternion: Array
    base_quaternion: Array
    base_linear_velocity: Array
    base_angular_velocity: Array
    joint_position: Array
    joint_velocity: Array
    action: Array
    bodies: Bodies
    object_pose: Array | None = None
    object_linear_velocity: Array | None = None


@dataclass(frozen=True)
class ObservationTerm:
    """A part of an observation.

    Attributes:
        name: Name of the term, BeyondMimic's where it has one.
        start: Index of its first entry.
        size: Number of entries.
        noise: Half width of its uniform noise.
        unit: Unit of its entries.
        meaning: What it is, for people.
    """

    name: str
    start: int
    size: int
    noise: float
    unit: str
    meaning: str

    @property
    def slice(self) -> slice:
        """Where the term is in the observation."""
        return slice(self.start, self.start + self.size)


@dataclass(frozen=True)
class ObservationLayout:
    """An ordered list of terms.

    Attributes:
        terms: The terms in order.
    """

    terms: tuple[ObservationTerm, ...]

    @property
    def size(self) -> int:
        """Length of the observation."""
        return self.terms[-1].start + self.terms[-1].size

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the terms in order."""
        return tuple(t.name for t in self.terms)

    @property
    def slices(self) -> dict[str, slice]:
        """Name to slice."""
        return {t.name: t.slice for t in self.terms}

    @property
    def noise(self) -> np.ndarray:
        """(size,) half widths of the uniform noise, float32."""
        return np.concatenate([np.full(t.size, t.noise, np.float32) for t in self.terms])


_NO_NOISE = ObservationNoise(*[0.0] * 6)


def policy_layout(config: ObservationConfig, joints: int) -> ObservationLayout:
    """Returns the policy's observation: 5n + 15 entries, or 5n + 9 without state estimation."""
    return _layout(_policy_terms(config.noise or _NO_NOISE, joints, config.state_estimation))


def critic_layout(joints: int, bodies: int, has_object: bool) -> ObservationLayout:
    """Returns the critic's observation: everything that the policy may see, bodies and object."""
    terms = _policy_terms(_NO_NOISE, joints, state_estimation=True)
    terms += [
        ("body_pos_b", 3 * bodies, 0.0, "m", "tracked bodies in the anchor frame"),
        ("body_ori_b", 6 * bodies, 0.0, "–", "their orientation, two matrix columns"),
    ]
    if has_object:
        terms += [
            ("obj_pos_b", 3, 0.0, "m", "object in the anchor frame"),
            ("obj_ori_b", 6, 0.0, "–", "its orientation, two matrix columns"),
            ("obj_lin_vel_b", 3, 0.0, "m/s", "its velocity, in the anchor's axes"),
        ]
    return _layout(terms)


def _policy_terms(
    noise: ObservationNoise, n: int, state_estimation: bool
) -> list[tuple[str, int, float, str, str]]:
    estimated = [
        (
            "motion_anchor_pos_b",
            3,
            noise.anchor_position,
            "m",
            "reference anchor seen by the robot's",
        ),
        ("base_lin_vel", 3, noise.base_linear_velocity, "m/s", "root velocity in the root frame"),
    ]
    position, velocity = estimated if state_estimation else (None, None)
    terms = [
        ("command", 2 * n, 0.0, "rad, rad/s", "reference joints: positions, velocities"),
        position,
        ("motion_anchor_ori_b", 6, noise.anchor_orientation, "–", "its orientation, two columns"),
        velocity,
        (
            "base_ang_vel",
            3,
            noise.base_angular_velocity,
            "rad/s",
            "root rotation in the root frame",
        ),
        ("joint_pos", n, noise.joint_position, "rad", "joint positions minus default"),
        ("joint_vel", n, noise.joint_velocity, "rad/s", "joint velocities"),
        ("actions", n, 0.0, "–", "previous action"),
    ]
    return [t for t in terms if t is not None]


def _layout(rows: Sequence[tuple[str, int, float, str, str]]) -> ObservationLayout:
    terms, start = [], 0
    for name, size, noise, unit, meaning in rows:
        terms.append(ObservationTerm(name, start, size, noise, unit, meaning))
        start += size
    return ObservationLayout(tuple(terms))


def policy_observation(state: ObservedState, state_estimation: bool = True) -> Array:
    """Returns (N, size) the policy's observation without noise, as ``policy_layout`` orders it."""
    xp = array_namespace(state.joint_position)
    anchor, base = state.anchor_quaternion, state.base_quaternion
    relative = quaternion.multiply(quaternion.conjugate(anchor), state.reference_anchor_quaternion)
    parts = [state.reference_joint_position, state.reference_joint_velocity]
    if state_estimation:
        offset = state.reference_anchor_position - state.anchor_position
        parts.append(quaternion.rotate_inverse(anchor, offset))
    parts.append(quaternion.rot6d(relative))
    if state_estimation:
        parts.append(quaternion.rotate_inverse(base, state.base_linear_velocity))
    parts += [state.base_angular_velocity, state.joint_position, state.joint_velocity, state.action]
    return xp.concat(parts, -1)


def critic_observation(state: ObservedState) -> Array:
    """Returns (N, size) the critic's observation, in the order of ``critic_layout``."""
    xp = array_namespace(state.joint_position)
    n = state.joint_position.shape[0]
    anchor = state.anchor_quaternion[:, None, :]
    arm = state.bodies.position - state.anchor_position[:, None, :]
    parts = [
        policy_observation(state),
        xp.reshape(quaternion.rotate_inverse(anchor, arm), (n, -1)),
        xp.reshape(
            quaternion.rot6d(quaternion.conjugate_multiply(anchor, state.bodies.quaternion)),
            (n, -1),
        ),
    ]
    if state.object_pose is not None and state.object_linear_velocity is not None:
        pose, anchor = state.object_pose, state.anchor_quaternion
        parts += [
            quaternion.rotate_inverse(anchor, pose[:, :3] - state.anchor_position),
            quaternion.rot6d(quaternion.conjugate_multiply(anchor, pose[:, 3:])),
            quaternion.rotate_inverse(anchor, state.object_linear_velocity),
        ]
    return xp.concat(parts, -1)
