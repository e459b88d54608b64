"""The ``beyondmimic`` profile: network, normalisation and motion in one ONNX file.

Inputs ``obs`` [1, ·] and ``time_step`` [1, 1], outputs ``actions`` and the motion's frame at
``time_step``, which stays at the last frame once the motion is over. Read by
motion_tracking_controller, mjlab and whatever follows BeyondMimic's convention.

A residual policy is folded into the standard action, so that ``default + scale · actions`` is its
joint target: actions = a + (reference + lead - default) / scale. The reference comes from the
observation, the very numbers that the network saw; the lead of a feedforward policy is a table over
the frames. The observed previous action is the standard action in all modes, in training too.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.errors import InvalidDataError, MissingDependencyError
from omni_envs.export.description import COMMAND, PolicyDescription

try:
    import onnx
    import torch
    from torch import Tensor, nn
except ImportError as error:
    missing = getattr(error, "name", None) or "onnx"
    raise MissingDependencyError(missing, "export", "Exporting a policy") from error

INPUTS = ("obs", "time_step")
OUTPUTS = (
    "actions",
    "joint_pos",
    "joint_vel",
    "body_pos_w",
    "body_quat_w",
    "body_lin_vel_w",
    "body_ang_vel_w",
)
OPSET = 18


class BeyondMimicGraph(nn.Module):
    """The graph that is exported.

    Args:
        actor: Observation (1, ·) → action (1, n), normalisation and clipping included.
        description: Robot, motion, observation, action.

    Raises:
        InvalidDataError: Actor, observation and robot do not fit together.
    """

    default: Tensor
    lead: Tensor
    scale: Tensor
    body_pos_w: Tensor

    def __init__(self, actor: nn.Module, description: PolicyDescription) -> None:
        super().__init__()
        robot, reference = description.robot, description.reference
        self.actor = actor
        self.size, n = description.layout.size, robot.num_joints
        with torch.no_grad():
            shape = tuple(actor(torch.zeros(1, self.size)).shape)
        if shape != (1, n):
            raise InvalidDataError("Policy", "action", f"(1, {n}) for {robot.title}", f"{shape}")
        self.residual = description.targets is not None
        if self.residual and COMMAND not in description.layout.names:
            raise InvalidDataError(
                "Residual policy",
                "observation",
                f"with the term {COMMAND!r}",
                ", ".join(description.layout.names),
            )
        start = description.layout.slices[COMMAND].start if self.residual else 0
        self.command = slice(start, start + n)
        self.last_frame = reference.num_frames - 1
        tracked = reference.body_indices(robot.tracked_bodies)
        lead = 0.0
        if description.targets is not None:
            lead = description.targets - reference.joint_positions
        self.leads = bool(np.any(lead))
        for name, array in {
            "lead": lead,
            "default": robot.default_joint_array,
            "scale": description.action_scale,
            "joint_pos": reference.joint_positions,
            "joint_vel": reference.joint_velocities,
            "body_pos_w": reference.body_positions[:, tracked],
            "body_quat_w": reference.body_quaternions[:, tracked],
            "body_lin_vel_w": reference.body_linear_velocities[:, tracked],
            "body_ang_vel_w": reference.body_angular_velocities[:, tracked],
        }.items():
            self.register_buffer(name, torch.as_tensor(np.asarray(array), dtype=torch.float32))

    def forward(self, obs: Tensor, time_step: Tensor) -> tuple[Tensor, ...]:
        """Returns the tensors of ``OUTPUTS``."""
        frame = time_step.to(torch.int64).squeeze(-1).clamp(0, self.last_frame)
        actions = self.actor(obs)
        if self.residual:
            target = obs[:, self.command]
            if self.leads:
                target = target + self.lead[frame]
            actions = actions + (target - self.default) / self.scale
        return actions, *(getattr(self, name)[frame] for name in OUTPUTS[1:])


def write_beyondmimic(graph: BeyondMimicGraph, path: Path, metadata: Mapping[str, str]) -> Path:
    """Writes the ONNX file, checked, whole or not at all.

    Args:
        graph: What to export.
        path: The file.
        metadata: Strings kept in the file.

    Raises:
        InvalidDataError: The file that came out is not what the profile asks for.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".{os.getpid()}.partial")
    example = (torch.zeros(1, graph.size), torch.zeros(1, 1))
    try:
        with warnings.catch_warnings():
            # The tracing exporter is deprecated; the new one needs onnxscript and writes two files.
            warnings.simplefilter("ignore")
            torch.onnx.export(
                graph.eval(),
                example,
                partial,
                input_names=list(INPUTS),
                output_names=list(OUTPUTS),
                opset_version=OPSET,
                dynamo=False,
            )
        model = onnx.load(partial)
        onnx.helper.set_model_props(model, dict(metadata))
        onnx.checker.check_model(model, full_check=True)
        _check_signature(model, graph)
        partial.write_bytes(model.SerializeToString())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def _check_signature(model: Any, graph: BeyondMimicGraph) -> None:
    n, bodies = len(graph.default), graph.body_pos_w.shape[1]
    expected = {
        "obs": (1, graph.size),
        "time_step": (1, 1),
        "actions": (1, n),
        "joint_pos": (1, n),
        "joint_vel": (1, n),
        "body_pos_w": (1, bodies, 3),
        "body_quat_w": (1, bodies, 4),
        "body_lin_vel_w": (1, bodies, 3),
        "body_ang_vel_w": (1, bodies, 3),
    }
    found = {
        value.name: tuple(d.dim_value for d in value.type.tensor_type.shape.dim)
        for value in (*model.graph.input, *model.graph.output)
    }
    if found != expected or list(found) != list(expected):
        raise InvalidDataError("ONNX file", "inputs and outputs", f"{expected}", f"{found}")
