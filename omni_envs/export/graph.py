"""What every policy file computes: standard actions from observation and frame, in one ONNX graph.

A residual policy is folded into the standard action, so that ``default + scale · actions`` is its
joint target: actions = a + (reference + lead - default) / scale. The reference comes from the
observation, the very numbers that the network saw; the lead of a feedforward policy is a table over
the frames. Stacks differ in the frame that they observe at a time step, this one or the one before
it: the lead is that of the frame which the observation shows. The observed previous action is the
standard action in all modes, in training too.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from omni_envs.errors import InvalidDataError, MissingDependencyError
from omni_envs.export.description import COMMAND, PolicyDescription
from omni_envs.files import complete_file

try:
    import onnx
    import torch
    from torch import Tensor, nn
except ImportError as error:
    missing = getattr(error, "name", None) or "onnx"
    raise MissingDependencyError(missing, "export", "Exporting a policy") from error


class PolicyGraph(nn.Module):
    """The graph of a profile; ``forward`` takes ``inputs`` and returns ``outputs``.

    Attributes:
        inputs: Names of the inputs.
        outputs: Names of the outputs, actions first.
        opset: Version of the ONNX operators.
        size: Length of the observation.
        terms: The stack's name of each term of the file's observation, in its order, and the term.
        order: (size,) place in our observation of each entry of the file's, or None where it is
            the same.
        last_frame: Index of the motion's last frame.

    Args:
        actor: Observation (1, ·) → action (1, n), normalisation and clipping included.
        description: Robot, motion, observation, action.

    Raises:
        InvalidDataError: Actor, observation and robot do not fit together.
    """

    inputs: ClassVar[tuple[str, ...]] = ("obs", "time_step")
    outputs: ClassVar[tuple[str, ...]] = ("actions",)
    opset: ClassVar[int] = 18
    default: Tensor
    commands: Tensor
    lead: Tensor
    nearby: Tensor
    scale: Tensor

    def __init__(self, actor: nn.Module, description: PolicyDescription) -> None:
        super().__init__()
        robot, reference = description.robot, description.reference
        self.actor = actor
        self.terms = tuple((term.name, term) for term in description.layout.terms)
        self.order: np.ndarray | None = None
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
        lead = 0.0
        if description.targets is not None:
            lead = description.targets - reference.joint_positions
        self.leads = bool(np.any(lead))
        if self.leads:
            motion = (reference.joint_positions, reference.joint_velocities)
            self.both = description.layout.slices[COMMAND]
            self.keep(commands=np.concatenate(motion, axis=1))
            self.register_buffer("nearby", torch.tensor([0, -1, 1]))
        self.keep(lead=lead, default=robot.default_joint_array, scale=description.action_scale)

    def keep(self, **arrays: Any) -> None:
        """Makes arrays constants of the graph, in single precision."""
        for name, array in arrays.items():
            self.register_buffer(name, torch.as_tensor(np.asarray(array), dtype=torch.float32))

    def frame(self, time_step: Tensor) -> Tensor:
        """Returns the frame (1,) at a time step (1, 1): the last one once the motion is over."""
        return time_step.to(torch.int64).squeeze(-1).clamp(0, self.last_frame)

    def standard_actions(self, obs: Tensor, frame: Tensor) -> Tensor:
        """Returns the standard actions (1, n) for our observation (1, size) at a frame (1,)."""
        actions = self.actor(obs)
        if self.residual:
            target = obs[:, self.command]
            if self.leads:
                target = target + self.lead[self.shown(obs, frame)]
            actions = actions + (target - self.default) / self.scale
        return actions

    def shown(self, obs: Tensor, frame: Tensor) -> Tensor:
        """Returns the frame (1,), of this and its neighbours, that the observation has as command.

        Of equal ones the first, this frame before all.
        """
        near = (frame + self.nearby).clamp(0, self.last_frame)
        off = (self.commands[near] - obs[:, self.both]) ** 2
        return near[off.sum(dim=-1).argmin(dim=0, keepdim=True)]

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Returns the shape of every input and output, in order."""
        shapes = {"obs": (1, self.size), "time_step": (1, 1)}
        with torch.no_grad():
            found = self(*(torch.zeros(shapes[name]) for name in self.inputs))
        return {name: shapes[name] for name in self.inputs} | {
            name: tuple(tensor.shape) for name, tensor in zip(self.outputs, found, strict=True)
        }


def write_graph(graph: PolicyGraph, path: Path, metadata: Mapping[str, str]) -> Path:
    """Writes the ONNX file, checked, whole or not at all.

    Args:
        graph: What to export.
        path: The file.
        metadata: Strings kept in the file.

    Raises:
        InvalidDataError: The file that came out is not what the profile asks for.
    """
    shapes = graph.eval().shapes()
    example = tuple(torch.zeros(shapes[name]) for name in graph.inputs)
    with complete_file(path) as temporary:
        with warnings.catch_warnings():
            # The tracing exporter is deprecated; the new one needs onnxscript and writes two files.
            warnings.simplefilter("ignore")
            torch.onnx.export(
                graph,
                example,
                temporary,
                input_names=list(graph.inputs),
                output_names=list(graph.outputs),
                opset_version=graph.opset,
                dynamo=False,
            )
        model = onnx.load(temporary)
        onnx.helper.set_model_props(model, dict(metadata))
        onnx.checker.check_model(model, full_check=True)
        _check_signature(model, shapes)
        temporary.write_bytes(model.SerializeToString())
    return path


def _check_signature(model: Any, expected: Mapping[str, tuple[int, ...]]) -> None:
    found = {
        value.name: tuple(d.dim_value for d in value.type.tensor_type.shape.dim)
        for value in (*model.graph.input, *model.graph.output)
    }
    if found != expected or list(found) != list(expected):
        raise InvalidDataError("ONNX file", "inputs and outputs", f"{expected}", f"{found}")
