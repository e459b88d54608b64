"""A policy file in the place of a trained network."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.errors import FileFormatError, InvalidDataError, MissingDependencyError

INPUTS = (("obs", "time_step"), ("obs",))
ACTIONS = "actions"
ORDER = "omni_envs_observation_order"
"""Metadata of a file that takes observations in another order: our place of each of its entries."""


class OnnxPolicy:
    """Runs an exported ONNX file, of any profile, in ONNX Runtime, one thread.

    Args:
        path: The file.

    Attributes:
        metadata: Strings of the file's metadata.
        observation_size: Length of the observation that it takes.

    Raises:
        FileFormatError: The file is missing, not an ONNX model, or of another profile.
        MissingDependencyError: ONNX Runtime is not installed.
    """

    def __init__(self, path: str | Path) -> None:
        try:
            import onnxruntime as ort
        except ImportError as error:
            raise MissingDependencyError(
                "onnxruntime", "export", "Running a policy file"
            ) from error
        self.path = Path(path)
        if not self.path.is_file():
            raise FileFormatError(path, "file", "an ONNX policy", "nothing")
        options = ort.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 3
        try:
            self._session = ort.InferenceSession(
                self.path.read_bytes(), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # ONNX Runtime raises a different class per damage
            reason = str(error).splitlines()[0]
            raise FileFormatError(path, "content", "an ONNX model", reason) from error
        shapes = {i.name: i.shape for i in self._session.get_inputs()}
        if tuple(shapes) not in INPUTS or shapes.get("time_step", [1, 1]) != [1, 1]:
            raise FileFormatError(
                path,
                "inputs",
                "obs [1, ·], and time_step [1, 1] where it needs it",
                f"{shapes or 'none'}",
            )
        self._inputs = tuple(shapes)
        self.outputs = tuple(o.name for o in self._session.get_outputs())
        if self.outputs[:1] != (ACTIONS,):
            raise FileFormatError(path, "outputs", "actions first", f"{self.outputs}")
        self.metadata: dict[str, str] = dict(self._session.get_modelmeta().custom_metadata_map)
        self.observation_size = int(shapes["obs"][1])
        self._order = self._read_order()

    def __call__(self, observations: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Returns the actions (N, n) for observations (N, ·) at reference frames (N,)."""
        if observations.ndim != 2 or observations.shape[1] != self.observation_size:
            raise InvalidDataError(
                str(self.path),
                "observations",
                f"(N, {self.observation_size})",
                f"{observations.shape}",
            )
        rows = zip(observations[:, self._order], frames, strict=True)
        return np.concatenate([self.run(o, int(f))[ACTIONS] for o, f in rows])

    def run(self, observation: np.ndarray, frame: int) -> dict[str, Any]:
        """Returns every output, each with a leading 1, for one observation as the file has it."""
        fed = {
            "obs": np.asarray(observation, np.float32)[None],
            "time_step": np.array([[frame]], np.float32),
        }
        fed = {name: fed[name] for name in self._inputs}
        return dict(zip(self.outputs, self._session.run(None, fed), strict=True))

    def _read_order(self) -> np.ndarray:
        """Returns the (size,) places of the file's entries in our observation."""
        plain = np.arange(self.observation_size)
        if ORDER not in self.metadata:
            return plain
        try:
            order = np.asarray(json.loads(self.metadata[ORDER]))
        except ValueError as error:
            raise FileFormatError(self.path, ORDER, "a list", self.metadata[ORDER]) from error
        if not np.array_equal(np.sort(order.ravel()), plain):
            raise FileFormatError(self.path, ORDER, "every entry once", self.metadata[ORDER])
        return order
