import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import torch

from omni_envs.errors import InvalidDataError
from omni_envs.export.parity import parity


@pytest.fixture
def exported(described, export):
    graph, file, _ = export("beyondmimic", described())
    return graph, file


@pytest.mark.parametrize("change", [1e-3, float("nan")])
def test_a_file_that_computes_something_else_is_refused(exported, change):
    graph, file = exported
    assert parity(graph, file, np.zeros((1, 154))) <= 1e-5
    with torch.no_grad():
        graph.actor[3].bias[4] += change
    with pytest.raises(
        InvalidDataError, match="actions at time step 0 must be that of the network"
    ):
        parity(graph, file, np.zeros((1, 154)))


def test_a_motion_that_differs_beyond_its_end_alone_is_refused(exported):
    graph, file = exported
    with torch.no_grad():
        graph.joint_pos[graph.last_frame, 0] += 1e-3
    with pytest.raises(InvalidDataError, match="joint_pos at time step 11 must be"):
        parity(graph, file, np.zeros((1, 154)))
