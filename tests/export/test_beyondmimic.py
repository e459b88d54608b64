import csv

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")

from omni_envs.export.beyondmimic import BeyondMimicGraph
from omni_envs.export.parity import parity
from omni_envs.robots import G1

RNG = np.random.default_rng(0)
ALL = {"anchor": None, "observation": {}}
"""Options of policies as BeyondMimic has them: 160 numbers, estimated state included."""


@pytest.mark.parametrize("mode", ["default", "residual", "feedforward"])
@pytest.mark.parametrize("state_estimation", [True, False])
def test_file_computes_what_the_network_computes(described, export, mode, state_estimation):
    description = described(mode, observation={"state_estimation": state_estimation})
    graph, file, _ = export("beyondmimic", description)
    assert file.observation_size == description.layout.size == (160 if state_estimation else 154)
    assert file.outputs == BeyondMimicGraph.outputs
    observations = RNG.normal(size=(8, file.observation_size)) * 3
    assert parity(graph, file, observations) <= 1e-5


def test_motion_is_embedded_and_stays_at_its_last_frame(motion, described, export):
    _, file, _ = export("beyondmimic", described(**ALL))
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


def test_metadata_has_the_keys_of_the_profile_and_all_digits(described, export):
    description = described(preset="beyondmimic", **ALL)
    _, file, _ = export("beyondmimic", description)
    assert set(file.metadata) == {
        "run_path", "joint_names", "joint_stiffness", "joint_damping", "default_joint_pos",
        "command_names", "observation_names", "observation_history_lengths", "action_scale",
        "anchor_body_name", "body_names",
    }  # fmt: skip
    rows = {key: next(csv.reader([value])) for key, value in file.metadata.items()}
    assert rows["joint_names"] == list(G1.joint_names)
    assert [float(v) for v in rows["action_scale"]] == G1.action_scale.tolist()
    assert [float(v) for v in rows["joint_stiffness"]] == [a.stiffness for a in G1.actuators]
    assert [float(v) for v in rows["joint_damping"]] == [a.damping for a in G1.actuators]
    assert [float(v) for v in rows["default_joint_pos"]] == G1.default_joint_array.tolist()
    assert rows["body_names"] == list(G1.tracked_bodies)
    assert rows["anchor_body_name"] == ["torso_link"]
    assert rows["observation_names"] == [
        "command", "motion_anchor_pos_b", "motion_anchor_ori_b", "base_lin_vel", "base_ang_vel",
        "joint_pos", "joint_vel", "actions",
    ]  # fmt: skip
    assert description.anchor_body == "torso_link"
