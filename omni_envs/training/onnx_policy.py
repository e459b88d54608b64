"""A policy file in the place of a trained network."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.errors import FileFormatError, InvalidDataError, MissingDependencyError

INPUTS = ("obs", "time_step")
ACTIONS = "actions"


class OnnxPolicy:
    """Runs an ONNX file of the ``beyondmimic`` profile in ONNX Runtime, one thread.

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
        if tuple(shapes) != INPUTS or shapes["time_step"] != [1, 1]:
            raise FileFormatError(
                path, "inputs", "obs [1, ·] and time_step [1, 1]", f"{shapes or 'none'}"
            )
        self.outputs = tuple(o.name for o in self._session.get_outputs())
        if self.outputs[:1] != (ACTIONS,):
            raise FileFormatError(path, "outputs", "actions first", f"{self.outputs}")
        self.metadata: dict[str, str] = dict(self._session.get_modelmeta().custom_metadata_map)
        self.observation_size = int(shapes["obs"][1])

    def __call__(self, observations: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Returns the actions (N, n) for observations (N, ·) at reference frames (N,)."""
        if observations.ndim != 2 or observations.shape[1] != self.observation_size:
            raise InvalidDataError(
                str(self.path),
                "observations",
                f"(N, {self.observation_size})",
                f"{observations.shape}",
            )
        rows = zip(observations, frames, strict=True)
        return np.concatenate([self.run(o, int(f))[ACTIONS] for o, f in rows])

    def run(self, observation: np.ndarray, frame: int) -> dict[str, Any]:
        """Returns every output, each with a leading 1, for one observation and frame."""
        fed = {
            "obs": np.asarray(observation, np.float32)[None],
            "time_step": np.array([[frame]], np.float32),
        }
        return dict(zip(self.outputs, self._session.run(None, fed), strict=True))
