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

    def sidecar(self) -> dict[str, Any]:
        """Returns everything as JSON-compatible data, full precision."""
        actuators = self.robot.actuators
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
                        "name": t.name,
                        "start": t.start,
                        "size": t.size,
                        "unit": t.unit,
                        "meaning": t.meaning,
                    }
                    for t in self.layout.terms
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


def _csv(values: Sequence[float] | np.ndarray) -> str:
    return ",".join(repr(float(v)) for v in values)
