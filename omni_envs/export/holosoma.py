"""The ``holosoma`` profile: what holosoma_inference reads.

Inputs ``obs`` [1, 154] (for 29 joints) and ``time_step`` [1, 1], outputs ``actions`` and, at
``time_step``, joint positions and velocities and the pose of the anchor. Its observation has the
terms in alphabetical order of its own names, and every value of the metadata is JSON. The robot's
URDF travels in the metadata: the stack has the robot's torso from it, and needs no file beside.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from torch import Tensor, nn

from omni_envs.export.description import PolicyDescription, need_torso_alone
from omni_envs.export.graph import PolicyGraph, write_graph
from omni_envs.export.urdf import robot_urdf
from omni_envs.training.onnx_policy import ORDER

NAMES = {
    "actions": "actions",
    "base_ang_vel": "base_ang_vel",
    "joint_pos": "dof_pos",
    "joint_vel": "dof_vel",
    "command": "motion_command",
    "motion_anchor_ori_b": "motion_ref_ori_b",
}
"""Our terms to holosoma's."""


class HolosomaGraph(PolicyGraph):
    """The graph that is exported; see ``PolicyGraph``.

    Raises:
        InvalidOptionError: The policy sees other terms than the stack has, or is anchored at
            another body than the torso.
    """

    outputs = ("actions", "joint_pos", "joint_vel", "ref_pos_xyz", "ref_quat_xyzw")
    opset = 13

    def __init__(self, actor: nn.Module, description: PolicyDescription) -> None:
        need_torso_alone(description, "holosoma")
        super().__init__(actor, description)
        layout, reference = description.layout, description.reference
        self.terms = tuple(sorted(((NAMES[t.name], t) for t in layout.terms), key=lambda t: t[0]))
        places = [np.arange(term.start, term.start + term.size) for _, term in self.terms]
        self.order = np.concatenate(places)
        self.ours = np.argsort(self.order).tolist()
        anchor = reference.body_indices([description.anchor_body])[0]
        self.keep(
            joint_pos=reference.joint_positions,
            joint_vel=reference.joint_velocities,
            ref_pos_xyz=reference.body_positions[:, anchor],
            ref_quat_xyzw=np.roll(reference.body_quaternions[:, anchor], -1, axis=-1),
        )

    def forward(self, obs: Tensor, time_step: Tensor) -> tuple[Tensor, ...]:
        """Returns the tensors of ``outputs``."""
        frame = self.frame(time_step)
        actions = self.standard_actions(obs[:, self.ours], frame)
        return actions, *(getattr(self, name)[frame] for name in self.outputs[1:])


def write_holosoma(
    graph: HolosomaGraph, description: PolicyDescription, path: Path, origin: str
) -> list[Path]:
    """Writes the file of the profile, whole or not at all; see ``write_beyondmimic``."""
    robot = description.robot
    values = {
        "run_path": origin,
        "dof_names": list(robot.joint_names),
        "kp": [a.stiffness for a in robot.actuators],
        "kd": [a.damping for a in robot.actuators],
        "default_joint_pos": robot.default_joint_array.tolist(),
        "action_scale": description.action_scale.tolist(),
        "command_ranges": {},
        "robot_urdf": robot_urdf(robot),
        "robot_urdf_path": f"{robot.name}.urdf",
        ORDER: np.argsort(graph.ours).tolist(),
    }
    return [write_graph(graph, path, {k: json.dumps(v) for k, v in values.items()})]
