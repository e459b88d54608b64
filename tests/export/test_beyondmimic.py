import csv
import json

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import onnx
import torch

from omni_envs.errors import InvalidDataError
from omni_envs.export.beyondmimic import BeyondMimicGraph, write_beyondmimic
from omni_envs.export.description import PolicyDescription
from omni_envs.export.parity import parity
from omni_envs.robots import G1
from omni_envs.tracking import make_config
from omni_envs.tracking.feedforward import action_targets
from omni_envs.tracking.observations import policy_layout
from omni_envs.training.normalizer import RunningNormalizer
from omni_envs.training.onnx_policy import OnnxPolicy

RNG = np.random.default_rng(0)


def _description(motion, **options) -> PolicyDescription:
    config = make_config(**options)
    mode = config.action.mode
    targets = None if mode == "default" else action_targets(G1, [motion], mode)[0]
    layout = policy_layout(config.observation, 29)
    return PolicyDescription(G1, motion, layout, config, targets)


def _actor(size: int, outputs: int = 29) -> torch.nn.Module:
    torch.manual_seed(0)
    normalizer = RunningNormalizer(size)
    normalizer.update(torch.randn(100, size) * 3 + 1)
    return torch.nn.Sequential(
        normalizer, torch.nn.Linear(size, 32), torch.nn.ELU(), torch.nn.Linear(32, outputs)
    )


def _export(motion, tmp_path, **options):
    description = _description(motion, **options)
    graph = BeyondMimicGraph(_actor(description.layout.size), description)
    (path,) = write_beyondmimic(graph, description, tmp_path / "policy.onnx", "runs/x")
    return description, graph, OnnxPolicy(path)


@pytest.mark.parametrize("mode", ["default", "residual", "feedforward"])
@pytest.mark.parametrize("state_estimation", [True, False])
def test_file_computes_what_the_network_computes(motion, tmp_path, mode, state_estimation):
    options = {
        "action": {"mode": mode},
        "observation": {"state_estimation": state_estimation},
    }
    description, graph, file = _export(motion, tmp_path, **options)
    assert file.observation_size == description.layout.size == (160 if state_estimation else 154)
    assert file.outputs == BeyondMimicGraph.outputs
    observations = RNG.normal(size=(8, file.observation_size)) * 3
    assert parity(graph, file, observations) <= 1e-5


def test_motion_is_embedded_and_stays_at_its_last_frame(motion, tmp_path):
    _, _, file = _export(motion, tmp_path)
    tracked = motion.body_indices(G1.tracked_bodies)
    zeros = np.zeros(160)
    for frame, row in ((0, 0), (5, 5), (11, 11), (12, 11), (5000, 11)):
        out = file.run(zeros, frame)
        for name, array in (
            ("joint_pos", motion.joint_positions),
            ("joint_vel", motion.joint_velocities),
            ("body_pos_w", motion.body_positions[:, tracked]),
            ("body_quat_w", motion.body_quaternions[:, tracked]),
            ("body_lin_vel_w", motion.body_linear_velocities[:, tracked]),
            ("body_ang_vel_w", motion.body_angular_velocities[:, tracked]),
        ):
            np.testing.assert_allclose(out[name][0], array[row], atol=1e-6)


@pytest.mark.parametrize("mode", ["residual", "feedforward"])
def test_residual_actions_are_folded_into_standard_ones(motion, tmp_path, mode):
    description, graph, file = _export(motion, tmp_path, action={"mode": mode, "scale": 0.5})
    observation = RNG.normal(size=160).astype(np.float32)
    command = motion.joint_positions[7]
    observation[:29] = command
    with torch.no_grad():
        residual = graph.actor(torch.from_numpy(observation)[None]).numpy()[0]
    standard = file.run(observation, 7)["actions"][0]
    target = G1.default_joint_array + description.action_scale * standard
    expected = description.targets[7] + description.action_scale * residual
    np.testing.assert_allclose(target, expected, atol=1e-5)
    ahead = np.abs(description.targets[7] - command).max()
    assert ahead == 0 if mode == "residual" else ahead > 0.05
    np.testing.assert_allclose(description.action_scale, 0.5 * G1.action_scale)


def test_metadata_has_the_keys_of_the_profile_and_all_digits(motion, tmp_path):
    description, _, file = _export(motion, tmp_path, preset="beyondmimic")
    assert set(file.metadata) == {
        "run_path", "joint_names", "joint_stiffness", "joint_damping", "default_joint_pos",
        "command_names", "observation_names", "observation_history_lengths", "action_scale",
        "anchor_body_name", "body_names",
    }  # fmt: skip
    rows = {key: next(csv.reader([value])) for key, value in file.metadata.items()}
    assert rows["joint_names"] == list(G1.joint_names)
    assert [float(v) for v in rows["action_scale"]] == G1.action_scale.tolist()
    assert [float(v) for v in rows["joint_stiffness"]] == [a.stiffness for a in G1.actuators]
    assert [float(v) for v in rows["default_joint_pos"]] == G1.default_joint_array.tolist()
    assert rows["body_names"] == list(G1.tracked_bodies)
    assert rows["anchor_body_name"] == ["torso_link"]
    assert rows["observation_names"] == [
        "command", "motion_anchor_pos_b", "motion_anchor_ori_b", "base_lin_vel", "base_ang_vel",
        "joint_pos", "joint_vel", "actions",
    ]  # fmt: skip
    assert description.anchor_body == "torso_link"


def test_sidecar_is_json_with_the_whole_layout(motion):
    description = _description(motion)
    data = json.loads(json.dumps(description.sidecar(), allow_nan=False))
    terms = data["observation"]["terms"]
    assert sum(t["size"] for t in terms) == data["observation"]["size"] == 160
    assert data["action"]["scale"] == G1.action_scale.tolist()
    assert data["anchor_body"] == "pelvis"
    assert data["reference"]["frames"] == 12 and data["control_step_s"] == 0.02


def test_the_file_is_one_checked_onnx_model(motion, tmp_path):
    _export(motion, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["policy.onnx"]
    model = onnx.load(tmp_path / "policy.onnx")
    onnx.checker.check_model(model, full_check=True)
    assert model.opset_import[0].version == 18


def test_a_file_that_computes_something_else_is_refused(motion, tmp_path):
    _, graph, file = _export(motion, tmp_path)
    with torch.no_grad():
        graph.actor[3].bias[4] += 1e-3
    with pytest.raises(
        InvalidDataError, match="actions at time step 0 must be that of the network"
    ):
        parity(graph, file, np.zeros((1, 160)))


def test_an_actor_of_another_robot_is_refused(motion):
    with pytest.raises(InvalidDataError, match=r"\(1, 29\) for Unitree G1; got \(1, 19\)"):
        BeyondMimicGraph(_actor(160, outputs=19), _description(motion))
