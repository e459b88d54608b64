"""The ``unitree`` profile: what the C++ deploy code of unitree_rl_lab and unitree_rl_mjlab reads.

Three files: ``policy.onnx`` with the input ``obs`` [1, 154] alone, ``deploy.yaml``, and the motion
as ``motion.npz`` at 50 Hz, which the stack plays by itself.

The stack tells the policy no time step. A feedforward policy needs to know the frame, for its table
of leads: it is the one whose joint positions and velocities the observation has as its command.
"""

from __future__ import annotations

from pathlib import Path

import torch
import yaml
from torch import Tensor, nn

from omni_envs.errors import InvalidOptionError
from omni_envs.export.description import COMMAND, PolicyDescription, need_torso_alone
from omni_envs.export.graph import PolicyGraph, write_graph
from omni_envs.references.formats import save_motion

NAMES = {
    "command": "motion_command",
    "motion_anchor_ori_b": "motion_anchor_ori_b",
    "base_ang_vel": "base_ang_vel",
    "joint_pos": "joint_pos_rel",
    "joint_vel": "joint_vel_rel",
    "actions": "last_action",
}
"""Our terms to Unitree's, in the order that both have."""
YAML, MOTION = "deploy.yaml", "motion.npz"


class UnitreeGraph(PolicyGraph):
    """The graph that is exported; see ``PolicyGraph``.

    Raises:
        InvalidOptionError: The policy sees other terms than the stack has, is anchored at another
            body than the torso, or is of another robot than the G1.
    """

    inputs = ("obs",)

    def __init__(self, actor: nn.Module, description: PolicyDescription) -> None:
        if description.robot.name != "g1":
            raise InvalidOptionError(
                "Profile 'unitree': the order of the motors is known for the Unitree G1 alone; "
                f"the policy is for the {description.robot.title}."
            )
        need_torso_alone(description, "unitree")
        if tuple(description.layout.names) != tuple(NAMES):
            raise InvalidOptionError(
                f"Profile 'unitree': the observation must be {', '.join(NAMES)}; "
                f"got {', '.join(description.layout.names)}."
            )
        super().__init__(actor, description)
        self.terms = tuple((NAMES[name], term) for name, term in self.terms)

    def forward(self, obs: Tensor) -> tuple[Tensor]:
        """Returns the actions (1, n)."""
        return (self.standard_actions(obs, torch.zeros(1, dtype=torch.int64)),)

    def shown(self, obs: Tensor, frame: Tensor) -> Tensor:
        """Returns the frame (1,), of all, that the observation has as command."""
        off = (self.commands - obs[:, self.both]) ** 2
        return off.sum(dim=-1).argmin(dim=0, keepdim=True)


def write_unitree(
    graph: UnitreeGraph, description: PolicyDescription, path: Path, origin: str
) -> list[Path]:
    """Writes the files of the profile; see ``write_beyondmimic``.

    Returns:
        The policy, ``deploy.yaml`` and ``motion.npz``, the latter two beside the policy.
    """
    robot, n = description.robot, description.robot.num_joints
    default = robot.default_joint_array.tolist()
    content = {
        "joint_ids_map": list(range(n)),
        "step_dt": description.config.physics.control_step,
        "stiffness": [a.stiffness for a in robot.actuators],
        "damping": [a.damping for a in robot.actuators],
        "default_joint_pos": default,
        "commands": {},
        "actions": {
            "JointPositionAction": {
                "clip": None,
                "joint_names": [".*"],
                "scale": description.action_scale.tolist(),
                "offset": default,
                "joint_ids": None,
            }
        },
        "observations": {
            NAMES[term.name]: {
                "params": {"command_name": "motion"} if term.name == COMMAND else {},
                "clip": None,
                "scale": [1.0] * term.size,
                "history_length": 1,
            }
            for term in description.layout.terms
        },
    }
    motion = save_motion(description.reference, path.with_name(MOTION), "unitree_deploy")
    deploy = path.with_name(YAML)
    deploy.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None))
    return [write_graph(graph, path, {"run_path": origin}), deploy, motion]
