import warnings

import numpy as np
import pytest

pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
pytest.importorskip("onnx")
import torch

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.training.onnx_policy import OnnxPolicy


class _Graph(torch.nn.Module):
    def forward(self, obs, time_step):
        return 2.0 * obs[:, :3] + time_step


@pytest.fixture
def file(tmp_path):
    return _write(tmp_path, ["obs", "time_step"], ["actions"])


def _write(folder, inputs, outputs):
    path = folder / "policy.onnx"
    example = (torch.zeros(1, 5), torch.zeros(1, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            _Graph(), example, path, input_names=inputs, output_names=outputs, dynamo=False
        )
    return path


def test_acts_for_many_simulations(file):
    policy = OnnxPolicy(file)
    observations = np.arange(20.0).reshape(4, 5)
    actions = policy(observations, np.array([0, 1, 2, 10]))
    np.testing.assert_array_equal(
        actions, 2 * observations[:, :3] + np.array([[0], [1], [2], [10]])
    )
    assert policy.observation_size == 5


def test_observations_of_another_size_are_refused(file):
    with pytest.raises(InvalidDataError, match=r"observations must be \(N, 5\); got \(2, 6\)"):
        OnnxPolicy(file)(np.zeros((2, 6)), np.zeros(2))


def test_missing_damaged_and_foreign_files_are_one_clear_error(file, tmp_path):
    with pytest.raises(FileFormatError, match="nothing"):
        OnnxPolicy(tmp_path / "none.onnx")
    with pytest.raises(FileFormatError, match="inputs: expected obs"):
        OnnxPolicy(_write(tmp_path, ["x", "time_step"], ["actions"]))
    with pytest.raises(FileFormatError, match="outputs: expected actions first"):
        OnnxPolicy(_write(tmp_path, ["obs", "time_step"], ["joint_pos"]))
    file.write_bytes(file.read_bytes()[:50])
    with pytest.raises(FileFormatError, match="content: expected an ONNX model"):
        OnnxPolicy(file)
