import json
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import onnx
import onnxruntime

from omni_envs.errors import FileFormatError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1, get_robot
from omni_envs.training.onnx_policy import ORDER, OnnxPolicy


def test_terms_are_in_alphabetical_order(described, export, observed):
    description = described()
    graph, file, _ = export("holosoma", description)
    names = [name for name, _ in graph.terms]
    assert names == [
        "actions", "base_ang_vel", "dof_pos", "dof_vel", "motion_command", "motion_ref_ori_b",
    ]  # fmt: skip
    seen = observed([4], description)
    parts = {name: seen[0, term.slice] for name, term in graph.terms}
    theirs = np.concatenate([parts[name] for name in sorted(parts)])
    assert theirs.shape == (154,)
    out = file.run(theirs, 4)
    np.testing.assert_allclose(out["actions"], file(seen, np.array([4])), atol=1e-6)
    starts = [t["start"] for t in description.sidecar(graph.terms)["observation"]["terms"]]
    assert starts == [0, 29, 32, 61, 90, 148]


def test_the_motion_is_the_torsos_and_ends_at_its_last_frame(motion, described, export):
    _, file, files = export("holosoma", described())
    torso = motion.body_indices(["torso_link"])[0]
    for frame, row in ((0, 0), (5, 5), (5000, 11)):
        out = file.run(np.zeros(154), frame)
        assert tuple(out) == ("actions", "joint_pos", "joint_vel", "ref_pos_xyz", "ref_quat_xyzw")
        position, (w, x, y, z) = (
            motion.body_positions[row, torso],
            motion.body_quaternions[row, torso],
        )
        np.testing.assert_allclose(out["ref_pos_xyz"], [position], atol=1e-6)
        np.testing.assert_allclose(out["ref_quat_xyzw"], [[x, y, z, w]], atol=1e-6)
        np.testing.assert_allclose(out["joint_pos"], [motion.joint_positions[row]], atol=1e-6)
        np.testing.assert_allclose(out["joint_vel"], [motion.joint_velocities[row]], atol=1e-6)
    assert onnx.load(files[0]).opset_import[0].version == 13


def test_the_signature_is_what_the_stack_runs(described, export):
    """It asks for its outputs by name, and feeds single precision under these names."""
    _, _, files = export("holosoma", described("feedforward"))
    session = onnxruntime.InferenceSession(files[0], providers=["CPUExecutionProvider"])
    assert [(i.name, i.shape, i.type) for i in session.get_inputs()] == [
        ("obs", [1, 154], "tensor(float)"),
        ("time_step", [1, 1], "tensor(float)"),
    ]
    assert [(o.name, o.shape, o.type) for o in session.get_outputs()] == [
        ("actions", [1, 29], "tensor(float)"),
        ("joint_pos", [1, 29], "tensor(float)"),
        ("joint_vel", [1, 29], "tensor(float)"),
        ("ref_pos_xyz", [1, 3], "tensor(float)"),
        ("ref_quat_xyzw", [1, 4], "tensor(float)"),
    ]
    fed = {"obs": np.zeros((1, 154), np.float32), "time_step": np.array([[0]], np.float32)}
    joint_pos, quaternion = session.run(["joint_pos", "ref_quat_xyzw"], fed)
    assert joint_pos.dtype == quaternion.dtype == np.float32


def test_the_urdf_has_the_motors_and_the_torso_by_the_stacks_names(described, export):
    _, file, _ = export("holosoma", described())
    root = ElementTree.fromstring(json.loads(file.metadata["robot_urdf"]))
    moving = [j.get("name") for j in root.iter("joint") if j.get("type") == "revolute"]
    assert sorted(moving) == sorted(json.loads(file.metadata["dof_names"])) and len(moving) == 29
    assert "torso_link" in [link.get("name") for link in root.iter("link")]


def test_metadata_is_json_with_gains_and_robot(described, export):
    _, file, _ = export("holosoma", described())
    assert set(file.metadata) == {
        "run_path", "dof_names", "kp", "kd", "default_joint_pos", "action_scale", "command_ranges",
        "robot_urdf", "robot_urdf_path", ORDER,
    }  # fmt: skip
    data = {key: json.loads(value) for key, value in file.metadata.items()}
    assert data["dof_names"] == list(G1.joint_names)
    assert data["kp"] == [a.stiffness for a in G1.actuators]
    assert data["kd"] == [a.damping for a in G1.actuators]
    assert data["action_scale"] == G1.action_scale.tolist()
    assert data["default_joint_pos"] == G1.default_joint_array.tolist()
    assert data["command_ranges"] == {}
    assert data["robot_urdf"].startswith("<robot") and data["robot_urdf_path"] == "g1.urdf"


def test_other_robots_have_observations_of_their_own_size(described, export):
    robot = get_robot("t1")
    standing = reference_from_qpos(robot, 50.0, np.tile(robot.default_qpos, (5, 1)))
    _, file, _ = export("holosoma", described(motion=standing, robot=robot))
    assert file.observation_size == 124
    assert json.loads(file.metadata["dof_names"]) == list(robot.joint_names)


def test_an_order_that_is_none_is_refused(described, export, tmp_path):
    _, _, files = export("holosoma", described())
    for text in ("[0, 0, 1]", "{", "3"):
        model = onnx.load(files[0])
        onnx.helper.set_model_props(model, {"omni_envs_observation_order": text})
        onnx.save(model, tmp_path / "other.onnx")
        with pytest.raises(FileFormatError, match="omni_envs_observation_order"):
            OnnxPolicy(tmp_path / "other.onnx")
