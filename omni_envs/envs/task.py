"""The tracking task bound to a robot and a configuration: judging a step, making an observation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omni_envs.errors import InvalidDataError, UnknownNameError
from omni_envs.robots import Robot
from omni_envs.tracking import kernels, observations, quaternion, rewards, terminations
from omni_envs.tracking.alignment import Bodies, align
from omni_envs.tracking.config import TrackingConfig
from omni_envs.tracking.motion import Frames


class Judgement(NamedTuple):
    """What a control step was worth, for N simulations.

    Attributes:
        reward: (N,) sum of the terms.
        terms: Term to (N,) weighted reward of this step.
        errors: Root of the squared tracking errors, (N,) each: m, rad, m/s, rad/s.
        tests: Termination test to (N,) bool.
    """

    reward: np.ndarray
    terms: dict[str, np.ndarray]
    errors: dict[str, np.ndarray]
    tests: dict[str, np.ndarray]


class TrackingTask:
    """Rewards, terminations and observations with all names resolved to indices.

    Attributes:
        config: The numbers.
        robot: The robot.
        terms: Names of the reward terms.
        errors: Names of the tracking errors.
        anchor: Index of the anchor among the tracked bodies.
        soft_lower: (n,) rad.
        soft_upper: (n,) rad.
        policy_layout: Terms of the policy's observation.
        critic_layout: Terms of the privileged observation.

    Args:
        robot: The robot.
        config: The numbers.
        has_object: Whether the scene has an object.
    """

    def __init__(self, robot: Robot, config: TrackingConfig, has_object: bool) -> None:
        self.config, self.robot, self._has_object = config, robot, has_object
        names = robot.tracked_bodies
        anchor = robot.anchor_body if config.anchor == "pelvis" else robot.torso_body
        for body in (anchor, *robot.end_effectors):
            if body not in names:
                raise InvalidDataError(
                    f"Robot {robot.name!r}", "tracked_bodies", f"with {body!r}", "not"
                )
        self.anchor = names.index(anchor)
        self._end_effectors = np.array([names.index(b) for b in robot.end_effectors])
        for body in config.reward.no_orientation:
            if body not in names:
                raise UnknownNameError("reward.no_orientation body", body, names)
        kept = [i for i, b in enumerate(names) if b not in config.reward.no_orientation]
        self._oriented = None if len(kept) == len(names) else np.array(kept)
        middle, half = robot.joint_ranges.mean(axis=1), 0.5 * np.ptp(robot.joint_ranges, axis=1)
        self.soft_lower = middle - config.reward.soft_limit * half
        self.soft_upper = middle + config.reward.soft_limit * half
        self._joints = slice(7, robot.nq)
        self._object = slice(robot.nq, robot.nq + 7)
        self._object_linear = slice(robot.nv, robot.nv + 3)
        n = robot.num_joints
        self.policy_layout = observations.policy_layout(config.observation, n)
        self.critic_layout = observations.critic_layout(n, len(names), has_object)
        reward, dt = config.reward, config.physics.control_step
        self.errors = tuple(n for n in rewards.TRACKING_TERMS if has_object or "object" not in n)
        kept = [i for i, n in enumerate(self.errors) if getattr(reward, n) is not None]
        tracking = {self.errors[i]: getattr(reward, self.errors[i]) for i in kept}
        self.terms = (*tracking, *rewards.PENALTY_TERMS)
        self._columns = kept
        self._inverse_variance = np.array([-1.0 / t.sigma**2 for t in tracking.values()])
        weights = [t.weight for t in tracking.values()]
        weights += [getattr(reward, name) for name in rewards.PENALTY_TERMS]
        self._weights = np.array(weights) * dt
        width = self.policy_layout.noise
        noisy = np.flatnonzero(width)
        self._noisy = slice(int(noisy[0]), int(noisy[-1]) + 1) if len(noisy) else slice(0, 0)
        # Uniform noise is drawn in [-½, ½).
        self._noise_width = 2.0 * width[self._noisy]

    def numbers(self, samples: int) -> kernels.Numbers:
        """Returns the task in the form that the compiled loops take.

        Args:
            samples: Physics steps that a contact sensor remembers.
        """
        config, robot = self.config, self.robot
        limits = config.termination
        oriented = np.ones(len(robot.tracked_bodies), bool)
        if self._oriented is not None:
            oriented[:] = False
            oriented[self._oriented] = True
        thresholds = (
            limits.anchor_height,
            limits.anchor_tilt,
            limits.end_effector_height,
            limits.object_position,
            limits.object_angle,
        )
        noisy = config.observation.noise is not None
        return kernels.Numbers(
            anchor=self.anchor,
            root_nq=robot.nq,
            root_nv=robot.nv,
            has_object=self._has_object,
            oriented=oriented,
            end_effectors=self._end_effectors,
            lower=self.soft_lower,
            upper=self.soft_upper,
            columns=np.array(self._columns, int),
            inverse_variance=self._inverse_variance,
            weights=self._weights,
            samples=samples,
            by_substep=config.reward.contact_rule == "substeps",
            contact_force=float(config.reward.contact_force),
            thresholds=np.array([np.inf if t is None else t for t in thresholds]),
            state_estimation=config.observation.state_estimation,
            noise_start=self._noisy.start,
            noise_width=self._noise_width if noisy else self._noise_width[:0],
        )

    def full_state(self, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
        """Returns (N, nq) and (N, nv): the reference as a state of the simulation."""
        if frames.object_pose is None or frames.object_velocity is None:
            return frames.qpos, frames.qvel
        linear, spin = frames.object_velocity[:, :3], frames.object_velocity[:, 3:]
        spin = quaternion.rotate_inverse(frames.object_pose[:, 3:], spin)
        qpos = np.concatenate([frames.qpos, frames.object_pose], axis=1)
        return qpos, np.concatenate([frames.qvel, linear, spin], axis=1)

    def judge(
        self,
        qpos: np.ndarray,
        bodies: Bodies,
        frames: Frames,
        action: np.ndarray,
        previous_action: np.ndarray,
        contact_forces: np.ndarray,
        object_active: bool,
    ) -> Judgement:
        """Compares the state after a control step with the reference frame that the policy saw.

        Args:
            qpos: (N, nq).
            bodies: The robot's tracked bodies.
            frames: The reference.
            action: (N, n).
            previous_action: (N, n).
            contact_forces: (N, sensors, samples, 3), N.
            object_active: Whether losing the object ends an episode.
        """
        config, a = self.config.reward, self.anchor
        reference = frames.bodies
        alignment = align(
            bodies.position[:, a],
            bodies.quaternion[:, a],
            reference.position[:, a],
            reference.quaternion[:, a],
        )
        squared = rewards.tracking_errors(
            bodies,
            reference,
            alignment,
            a,
            qpos[:, self._object] if self._has_object else None,
            frames.object_pose,
            self._oriented,
        )
        count = (
            rewards.substeps_in_contact
            if config.contact_rule == "substeps"
            else rewards.bodies_in_contact
        )
        joint_position = qpos[:, self._joints]
        penalties = [
            rewards.action_rate(action, previous_action),
            rewards.joint_limit_excess(joint_position, self.soft_lower, self.soft_upper),
            count(contact_forces, config.contact_force),
        ]
        # All tracking terms at once, one column each.
        e = np.stack([v for v in squared if v is not None], axis=1)
        tracking = np.exp(e[:, self._columns] * self._inverse_variance)
        values = np.concatenate([tracking, np.stack(penalties, axis=1)], axis=1) * self._weights
        terms = dict(zip(self.terms, values.T, strict=True))
        errors = dict(zip(self.errors, np.sqrt(e).T, strict=True))
        tests = self._tests(bodies, reference, squared, object_active)
        return Judgement(values.sum(axis=1), terms, errors, tests)

    def _tests(
        self,
        bodies: Bodies,
        reference: Bodies,
        squared: rewards.TrackingErrors,
        object_active: bool,
    ) -> dict[str, np.ndarray]:
        config, a = self.config.termination, self.anchor
        tests = {}
        if config.anchor_height is not None:
            tests["anchor_height"] = terminations.height_lost(
                bodies.position[:, a], reference.position[:, a], config.anchor_height
            )
        if config.anchor_tilt is not None:
            tests["anchor_tilt"] = terminations.tilt_lost(
                bodies.quaternion[:, a], reference.quaternion[:, a], config.anchor_tilt
            )
        if config.end_effector_height is not None:
            tests["end_effector_height"] = terminations.any_height_lost(
                bodies, reference, self._end_effectors, config.end_effector_height
            )
        if squared.object_position is not None and squared.object_orientation is not None:
            far = np.inf if config.object_position is None else config.object_position
            turned = np.inf if config.object_angle is None else config.object_angle
            lost = terminations.object_lost(
                squared.object_position, squared.object_orientation, far, turned
            )
            tests["object"] = lost & object_active
        return tests

    def observe(
        self,
        qpos: np.ndarray,
        qvel: np.ndarray,
        bodies: Bodies,
        frames: Frames,
        default: np.ndarray,
        action: np.ndarray,
        rng: np.random.Generator,
    ) -> np.ndarray | dict[str, np.ndarray]:
        """Returns fresh observations, float32.

        Args:
            qpos: (N, nq).
            qvel: (N, nv).
            bodies: The robot's tracked bodies.
            frames: The reference frame to track next.
            default: (N, n) default joint positions.
            action: (N, n) previous action.
            rng: Source of the noise.

        Returns:
            (N, size), or ``{"policy": (N, size), "critic": (N, size)}``.
        """
        config, a, joints = self.config.observation, self.anchor, self._joints
        state = observations.ObservedState(
            reference_joint_position=frames.qpos[:, joints],
            reference_joint_velocity=frames.qvel[:, 6:],
            reference_anchor_position=frames.bodies.position[:, a],
            reference_anchor_quaternion=frames.bodies.quaternion[:, a],
            anchor_position=bodies.position[:, a],
            anchor_quaternion=bodies.quaternion[:, a],
            base_quaternion=qpos[:, 3:7],
            base_linear_velocity=qvel[:, :3],
            base_angular_velocity=qvel[:, 3:6],
            joint_position=qpos[:, joints] - default,
            joint_velocity=qvel[:, 6 : self.robot.nv],
            action=action,
            bodies=bodies,
            object_pose=qpos[:, self._object] if self._has_object else None,
            object_linear_velocity=qvel[:, self._object_linear] if self._has_object else None,
        )
        policy = observations.policy_observation(state, config.state_estimation).astype(np.float32)
        if config.noise is not None:
            noise = rng.random((len(policy), len(self._noise_width)), dtype=np.float32)
            noise -= 0.5
            noise *= self._noise_width
            policy[:, self._noisy] += noise
        if not config.privileged:
            return policy
        critic = observations.critic_observation(state).astype(np.float32)
        return {"policy": policy, "critic": critic}
