"""What a deploy stack has to know about a policy, in words: file metadata and sidecar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import omni_envs
from omni_envs.errors import InvalidOptionError
from omni_envs.references import Reference
from omni_envs.robots import Robot
from omni_envs.tracking import ObservationLayout, TrackingConfig
from omni_envs.tracking.observations import ObservationTerm

COMMAND = "command"
"""Observation term that starts with the reference joint positions."""


@dataclass(frozen=True)
class PolicyDescription:
    """A policy's robot, motion, observation and action.

    Attributes:
        robot: The robot.
        reference: The motion that it tracks.
        layout: Terms of its observation.
        config: The task that it was trained on.
        targets: (T, n) joint positions that the network's actions count from, rad, or None where
            that is the default pose.
    """

    robot: Robot
    reference: Reference
    layout: ObservationLayout
    config: TrackingConfig
    targets: np.ndarray | None

    @property
    def action_scale(self) -> np.ndarray:
        """(n,) radians per unit of action."""
        return self.robot.action_scale * self.config.action.scale

    @property
    def anchor_body(self) -> str:
        """Body that anchors the comparison with the reference."""
        torso = self.config.anchor == "torso"
        return self.robot.torso_body if torso else self.robot.anchor_body

    def metadata(self, run_path: str) -> dict[str, str]:
        """Returns the metadata of the ``beyondmimic`` profile: comma-separated, all digits.

        Args:
            run_path: Where the policy comes from.
        """
        actuators = self.robot.actuators
        return {
            "run_path": run_path,
            "joint_names": ",".join(self.robot.joint_names),
            "joint_stiffness": _csv([a.stiffness for a in actuators]),
            "joint_damping": _csv([a.damping for a in actuators]),
            "default_joint_pos": _csv(self.robot.default_joint_array),
            "command_names": "motion",
            "observation_names": ",".join(self.layout.names),
            "observation_history_lengths": ",".join("1" for _ in self.layout.names),
            "action_scale": _csv(self.action_scale),
            "anchor_body_name": self.anchor_body,
            "body_names": ",".join(self.robot.tracked_bodies),
        }

    def sidecar(self, terms: Sequence[tuple[str, ObservationTerm]] | None = None) -> dict[str, Any]:
        """Returns everything as JSON-compatible data, full precision.

        Args:
            terms: Name and term of the file's observation in its order, by default our own.
        """
        actuators = self.robot.actuators
        terms = [(t.name, t) for t in self.layout.terms] if terms is None else terms
        starts = np.cumsum([0, *(t.size for _, t in terms)]).tolist()
        return {
            "omni_envs_version": omni_envs.__version__,
            "robot": self.robot.name,
            "control_step_s": self.config.physics.control_step,
            "action": {
                "meaning": "joint target = default_joint_positions + scale · actions",
                "trained_as": self.config.action.mode,
                "scale": self.action_scale.tolist(),
            },
            "observation": {
                "size": self.layout.size,
                "actions_term": "the previous output of this file",
                "terms": [
                    {
                        "name": name,
                        "start": start,
                        "size": t.size,
                        "unit": t.unit,
                        "meaning": t.meaning,
                    }
                    for (name, t), start in zip(terms, starts, strict=False)
                ],
            },
            "joint_names": list(self.robot.joint_names),
            "joint_stiffness": [a.stiffness for a in actuators],
            "joint_damping": [a.damping for a in actuators],
            "joint_effort": [a.effort for a in actuators],
            "default_joint_positions": self.robot.default_joint_array.tolist(),
            "anchor_body": self.anchor_body,
            "tracked_bodies": list(self.robot.tracked_bodies),
            "reference": {
                "frames": self.reference.num_frames,
                "fps": self.reference.fps,
                "provenance": dict(self.reference.provenance),
            },
        }


def describe(env: Any) -> PolicyDescription:
    """Returns the description of policies for an environment.

    Args:
        env: A (wrapped) ``OmniVectorEnv``.

    Raises:
        InvalidOptionError: The environment has several motions: a file holds one.
    """
    base = env.unwrapped
    if len(base.references) != 1:
        raise InvalidOptionError(
            f"A policy file holds one motion; the environment has {len(base.references)}."
        )
    targets = None if base.action_targets is None else base.action_targets[0]
    return PolicyDescription(
        base.robot, base.references[0], base.policy_layout, base.config, targets
    )


def need_torso_alone(description: PolicyDescription, profile: str) -> None:
    """Refuses policies that a stack would feed with something else than they were trained on.

    Args:
        description: The policy.
        profile: The stack's, which estimates no state and compares the torso with the motion.

    Raises:
        InvalidOptionError: The policy observes estimated state, or another anchor than the torso.
    """
    robot = description.robot
    wrong = None
    if description.config.observation.state_estimation:
        wrong = f"{description.layout.size} numbers, with estimated position and velocity"
    elif description.anchor_body != robot.torso_body:
        wrong = f"the {description.anchor_body} compared with the motion, not {robot.torso_body}"
    if wrong:
        raise InvalidOptionError(
            f"Profile {profile!r}: the policy was trained on {wrong}, which the stack does not "
            'have. Train with observation={"state_estimation": false} and anchor="torso".'
        )


def _csv(values: Sequence[float] | np.ndarray) -> str:
    return ",".join(repr(float(v)) for v in values)
