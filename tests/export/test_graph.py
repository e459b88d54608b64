"""What every policy file computes, and how it is written."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import onnx
import torch

from omni_envs.errors import InvalidDataError
from omni_envs.export import graph as module
from omni_envs.export.graph import PolicyGraph, write_graph


class Plain(PolicyGraph):
    """The least that a profile adds."""

    def forward(self, obs: torch.Tensor, time_step: torch.Tensor) -> tuple[torch.Tensor]:
        return (self.standard_actions(obs, self.frame(time_step)),)


@pytest.mark.parametrize("mode", ["residual", "feedforward"])
def test_actions_about_the_reference_are_folded_into_standard_ones(
    motion, described, actor, observed, mode
):
    description = described(mode, scale=0.5)
    graph = Plain(actor(description.layout.size), description)
    seen = torch.from_numpy(observed([7], description))
    with torch.no_grad():
        action = graph.actor(seen).numpy()[0]
        (standard,) = graph(seen, torch.tensor([[7.0]]))
    robot = description.robot
    np.testing.assert_allclose(description.action_scale, 0.5 * robot.action_scale)
    target = robot.default_joint_array + description.action_scale * standard.numpy()[0]
    expected = description.targets[7] + description.action_scale * action
    np.testing.assert_allclose(target, expected, atol=1e-5)
    ahead = np.abs(description.targets[7] - motion.joint_positions[7]).max()
    assert graph.leads == (mode == "feedforward") == (ahead > 0.05)


def test_actions_about_the_default_pose_are_the_networks(described, actor, observed):
    description = described()
    graph = Plain(actor(description.layout.size), description)
    seen = torch.from_numpy(observed([3], description))
    assert torch.equal(graph(seen, torch.tensor([[3.0]]))[0], graph.actor(seen))


def test_frames_stay_within_the_motion(described, actor):
    graph = Plain(actor(154), described())
    found = [int(graph.frame(torch.tensor([[t]]))) for t in (-1.0, 0.0, 5.0, 11.0, 12.0, 1e6)]
    assert found == [0, 0, 5, 11, 11, 11] and graph.last_frame == 11


def test_the_file_is_one_checked_onnx_model(described, actor, tmp_path):
    graph = Plain(actor(154), described("feedforward"))
    path = write_graph(graph, tmp_path / "new" / "policy.onnx", {"key": "value, with comma"})
    assert [p.name for p in path.parent.iterdir()] == ["policy.onnx"]
    model = onnx.load(path)
    onnx.checker.check_model(model, full_check=True)
    assert model.opset_import[0].version == Plain.opset == 18
    assert {p.key: p.value for p in model.metadata_props} == {"key": "value, with comma"}
    names = [[v.name for v in part] for part in (model.graph.input, model.graph.output)]
    assert names == [["obs", "time_step"], ["actions"]]


def test_a_model_with_another_signature_is_refused_and_leaves_nothing(
    described, actor, tmp_path, monkeypatch
):
    graph = Plain(actor(154), described("feedforward"))
    (tmp_path / "policy.onnx").write_text("an older one")
    monkeypatch.setattr(graph, "shapes", lambda: {"obs": (1, 154), "time_step": (1, 1)})
    with pytest.raises(InvalidDataError, match=r"inputs and outputs must be .*got .*actions"):
        write_graph(graph, tmp_path / "policy.onnx", {})
    assert [p.name for p in tmp_path.iterdir()] == ["policy.onnx"]
    assert (tmp_path / "policy.onnx").read_text() == "an older one"


def test_a_writer_that_dies_leaves_nothing(described, actor, tmp_path, monkeypatch):
    def dies(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(module.onnx.checker, "check_model", dies)
    with pytest.raises(KeyboardInterrupt):
        write_graph(Plain(actor(154), described()), tmp_path / "policy.onnx", {})
    assert list(tmp_path.iterdir()) == []


def test_an_actor_of_another_robot_is_refused(described, actor):
    with pytest.raises(InvalidDataError, match=r"\(1, 29\) for Unitree G1; got \(1, 19\)"):
        Plain(actor(154, outputs=19), described())


def test_a_residual_policy_has_to_see_the_reference(described, actor):
    description = described("residual")
    others = description.layout.terms[1:]
    blind = replace(description, layout=replace(description.layout, terms=tuple(others)))
    with pytest.raises(InvalidDataError, match="with the term 'command'; got motion_anchor_ori_b"):
        Plain(actor(154), blind)
