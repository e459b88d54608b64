from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import onnxruntime
import torch
import yaml
from scipy.spatial.transform import Rotation

from omni_envs.errors import InvalidOptionError
from omni_envs.export.profiles import WRITERS
from omni_envs.references import reference_from_qpos
from omni_envs.references.formats import load_motion
from omni_envs.robots import G1, get_robot


def test_the_stack_gets_three_files(motion, described, export):
    _, file, files = export("unitree", described("residual"))
    assert [f.name for f in files] == ["policy.onnx", "deploy.yaml", "motion.npz"]
    assert file.outputs == ("actions",)
    deploy = yaml.safe_load(files[1].read_text())
    assert deploy["joint_ids_map"] == list(range(29)) and deploy["step_dt"] == 0.02
    action = deploy["actions"]["JointPositionAction"]
    assert action["scale"] == G1.action_scale.tolist()
    assert action["offset"] == deploy["default_joint_pos"] == G1.default_joint_array.tolist()
    assert deploy["stiffness"] == [a.stiffness for a in G1.actuators]
    assert deploy["damping"] == [a.damping for a in G1.actuators]
    assert list(deploy["observations"]) == [
        "motion_command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos_rel", "joint_vel_rel",
        "last_action",
    ]  # fmt: skip
    sizes = [len(term["scale"]) for term in deploy["observations"].values()]
    assert sizes == [58, 6, 3, 29, 29, 29]
    for term in deploy["observations"].values():
        assert term["clip"] is None and term["history_length"] == 1 and set(term["scale"]) == {1.0}
    # What it asks of a term that is not there ends the stack.
    assert action["clip"] is None and action["joint_ids"] is None


def test_the_signature_is_what_the_stack_runs(described, export):
    _, _, files = export("unitree", described("feedforward"))
    session = onnxruntime.InferenceSession(files[0], providers=["CPUExecutionProvider"])
    (given,), (made,) = session.get_inputs(), session.get_outputs()
    assert (given.name, given.shape, given.type) == ("obs", [1, 154], "tensor(float)")
    assert (made.name, made.shape, made.type) == ("actions", [1, 29], "tensor(float)")
    assert files[0].parent == files[1].parent and not list(files[0].parent.glob("*.data"))


def test_the_motion_is_single_precision_with_the_root_first(motion, described, export):
    _, _, files = export("unitree", described())
    with np.load(files[2], allow_pickle=False) as file:
        arrays = {name: file[name] for name in ("body_pos_w", "body_quat_w")}
        arrays |= {name: file[name] for name in ("joint_pos", "joint_vel")}
    assert {a.dtype for a in arrays.values()} == {np.dtype(np.float32)}
    assert arrays["joint_pos"].shape == arrays["joint_vel"].shape == (12, 29)
    np.testing.assert_allclose(arrays["joint_pos"], motion.joint_positions, atol=1e-6)
    np.testing.assert_allclose(arrays["joint_vel"], motion.joint_velocities, atol=1e-5)
    np.testing.assert_allclose(arrays["body_pos_w"][:, 0], motion.qpos[:, :3], atol=1e-6)
    np.testing.assert_allclose(arrays["body_quat_w"][:, 0], motion.qpos[:, 3:7], atol=1e-6)
    np.testing.assert_allclose(load_motion(files[2]).qpos, motion.qpos, atol=1e-6)


def test_the_torso_is_where_the_stack_computes_it(motion, described):
    """From root and motors 12 to 14, about z, x and y: the anchor that the policy trained with."""
    assert G1.joint_names[12:15] == ("waist_yaw_joint", "waist_roll_joint", "waist_pitch_joint")
    rng = np.random.default_rng(1)
    qpos = np.tile(G1.default_qpos, (5, 1))
    qpos[:, 3:7] = Rotation.random(5, rng).as_quat(scalar_first=True)
    qpos[:, 19:22] = rng.uniform(-0.5, 0.5, (5, 3))
    moved = reference_from_qpos(G1, 50.0, qpos)
    root = Rotation.from_quat(qpos[:, 3:7], scalar_first=True)
    expected = root * Rotation.from_euler("ZXY", qpos[:, 19:22])
    torso = moved.body_quaternions[:, moved.body_indices([described().anchor_body])[0]]
    found = Rotation.from_quat(torso, scalar_first=True)
    np.testing.assert_allclose((expected.inv() * found).magnitude(), 0.0, atol=1e-6)


def test_a_feedforward_policy_knows_the_frame_by_the_command(described, export, observed):
    description = described("feedforward")
    graph, file, _ = export("unitree", description)
    for frame in range(12):
        seen = observed([frame], description)
        with torch.no_grad():
            action = graph.actor(torch.from_numpy(seen)).numpy()
        target = G1.default_joint_array + description.action_scale * file(seen, np.array([0]))
        expected = description.targets[frame] + description.action_scale * action
        np.testing.assert_allclose(target, expected, atol=1e-5)


def test_it_is_for_the_g1(described, actor):
    robot = get_robot("t1")
    standing = reference_from_qpos(robot, 50.0, np.tile(robot.default_qpos, (5, 1)))
    description = described(motion=standing, robot=robot)
    with pytest.raises(InvalidOptionError, match=r"known for the Unitree G1 alone; .* Booster T1"):
        WRITERS["unitree"].graph(actor(124, 23), description)


def test_a_motion_at_another_rate_does_not_fit(motion, described, export, tmp_path):
    with pytest.raises(InvalidOptionError, match="50 frames per second"):
        export("unitree", described(motion=replace(motion, fps=30.0)))
    assert list(tmp_path.iterdir()) == []
