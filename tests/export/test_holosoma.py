import json

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import onnx

from omni_envs.errors import FileFormatError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1, get_robot
from omni_envs.training.onnx_policy import OnnxPolicy


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


def test_metadata_is_json_with_gains_and_robot(described, export):
    _, file, _ = export("holosoma", described())
    data = {key: json.loads(value) for key, value in file.metadata.items()}
    assert data["dof_names"] == list(G1.joint_names)
    assert data["kp"] == [a.stiffness for a in G1.actuators]
    assert data["kd"] == [a.damping for a in G1.actuators]
    assert data["action_scale"] == G1.action_scale.tolist()
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
