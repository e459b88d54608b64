"""Does the file compute what the network computes?"""

from __future__ import annotations

import numpy as np
import torch

from omni_envs.errors import InvalidDataError
from omni_envs.export.graph import PolicyGraph
from omni_envs.training.onnx_policy import OnnxPolicy

TOLERANCE = 1e-5
MAX_OBSERVATIONS = 32


def parity(graph: PolicyGraph, file: OnnxPolicy, observations: np.ndarray) -> float:
    """Compares every output of file and network, the motion's end and beyond included.

    Args:
        graph: The exported network.
        file: The file.
        observations: (K, ·) observations of the environment to compare at, each at several time
            steps from 0 to beyond the motion's end; the first 32 count.

    Returns:
        Largest absolute difference.

    Raises:
        InvalidDataError: It is larger than 10⁻⁵.
    """
    end = graph.last_frame
    differences: dict[str, float] = {}
    if graph.order is not None:
        observations = observations[:, graph.order]
    for frame in sorted({0, 1, end // 2, end - 1, end, end + 1, end + 1000}):
        for observation in observations[:MAX_OBSERVATIONS]:
            fed = (
                torch.as_tensor(observation, dtype=torch.float32)[None],
                torch.tensor([[float(frame)]]),
            )
            with torch.no_grad():
                expected = graph(*fed[: len(graph.inputs)])
            found = file.run(observation, frame)
            for name, tensor in zip(graph.outputs, expected, strict=True):
                key = f"{name} at time step {frame}"
                # numpy's maximum keeps a NaN: that is a difference too.
                difference = np.abs(found[name] - tensor.numpy()).max()
                differences[key] = float(np.maximum(difference, differences.get(key, 0.0)))
    for key, difference in differences.items():
        if not difference <= TOLERANCE:
            raise InvalidDataError(
                str(file.path),
                key,
                f"that of the network within {TOLERANCE}",
                f"a difference of {difference:.3g}",
            )
    return max(differences.values())
