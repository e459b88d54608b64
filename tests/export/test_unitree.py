from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import torch
import yaml

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
    played = load_motion(files[2])
    np.testing.assert_allclose(played.qpos, motion.qpos, atol=1e-6)


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
