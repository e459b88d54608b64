"""The ``beyondmimic`` profile: network, normalisation and motion in one ONNX file.

Inputs ``obs`` [1, ·] and ``time_step`` [1, 1], outputs ``actions`` and the motion's frame at
``time_step``, which stays at the last frame once the motion is over. Read by
motion_tracking_controller, mjlab and whatever follows BeyondMimic's convention.
"""

from __future__ import annotations

from pathlib import Path

from torch import Tensor, nn

from omni_envs.export.description import PolicyDescription
from omni_envs.export.graph import PolicyGraph, write_graph


class BeyondMimicGraph(PolicyGraph):
    """The graph that is exported; see ``PolicyGraph``."""

    outputs = (
        "actions",
        "joint_pos",
        "joint_vel",
        "body_pos_w",
        "body_quat_w",
        "body_lin_vel_w",
        "body_ang_vel_w",
    )

    def __init__(self, actor: nn.Module, description: PolicyDescription) -> None:
        super().__init__(actor, description)
        reference = description.reference
        tracked = reference.body_indices(description.robot.tracked_bodies)
        self.keep(
            joint_pos=reference.joint_positions,
            joint_vel=reference.joint_velocities,
            body_pos_w=reference.body_positions[:, tracked],
            body_quat_w=reference.body_quaternions[:, tracked],
            body_lin_vel_w=reference.body_linear_velocities[:, tracked],
            body_ang_vel_w=reference.body_angular_velocities[:, tracked],
        )

    def forward(self, obs: Tensor, time_step: Tensor) -> tuple[Tensor, ...]:
        """Returns the tensors of ``outputs``."""
        frame = self.frame(time_step)
        actions = self.standard_actions(obs, frame)
        return actions, *(getattr(self, name)[frame] for name in self.outputs[1:])


def write_beyondmimic(
    graph: BeyondMimicGraph, description: PolicyDescription, path: Path, origin: str
) -> list[Path]:
    """Writes the file of the profile, whole or not at all.

    Args:
        graph: What to export.
        description: What it is.
        path: The file.
        origin: Where the policy comes from.
    """
    return [write_graph(graph, path, description.metadata(origin))]
