"""The same policy in every profile: what the stack feeds and what it does with the actions."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
pytest.importorskip("torch")
import onnx
import torch
import yaml

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.export.description import PolicyDescription
from omni_envs.export.parity import parity
from omni_envs.export.profiles import WRITERS
from omni_envs.export.run import PROFILES
from omni_envs.references import reference_from_qpos
from omni_envs.references.formats import load_motion
from omni_envs.robots import G1, get_robot
from omni_envs.tracking import make_config
from omni_envs.tracking.feedforward import action_targets
from omni_envs.tracking.observations import policy_layout
from omni_envs.training.normalizer import RunningNormalizer
from omni_envs.training.onnx_policy import OnnxPolicy

MODES = ("default", "residual", "feedforward")
RNG = np.random.default_rng(0)


def _description(motion, mode="default", robot=G1, **options) -> PolicyDescription:
    options = {"anchor": "torso", "observation": {"state_estimation": False}, **options}
    config = make_config(action={"mode": mode}, **options)
    targets = None if mode == "default" else action_targets(robot, [motion], mode)[0]
    layout = policy_layout(config.observation, robot.num_joints)
    return PolicyDescription(robot, motion, layout, config, targets)


def _actor(size: int, outputs: int) -> torch.nn.Module:
    torch.manual_seed(0)
    normalizer = RunningNormalizer(size)
    normalizer.update(torch.randn(100, size) * 3 + 1)
    return torch.nn.Sequential(normalizer, torch.nn.Linear(size, outputs), torch.nn.Tanh())


def _export(profile, description, folder):
    actor = _actor(description.layout.size, description.robot.num_joints)
    graph = WRITERS[profile].graph(actor, description)
    files = WRITERS[profile].write(graph, description, folder / "policy.onnx", "runs/x")
    return graph, OnnxPolicy(files[0]), files


def _observations(motion, frames, description) -> np.ndarray:
    """Observations of the environment, made up but for the command."""
    seen = RNG.normal(size=(len(frames), description.layout.size)).astype(np.float32)
    both = np.concatenate([motion.joint_positions, motion.joint_velocities], axis=1)
    seen[:, description.layout.slices["command"]] = both[frames]
    return seen


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("mode", MODES)
def test_every_profile_asks_for_the_joint_targets_of_the_network(motion, tmp_path, profile, mode):
    description = _description(motion, mode)
    graph, file, _ = _export(profile, description, tmp_path)
    frames = np.array([0, 3, 7, 11])
    seen = _observations(motion, frames, description)
    with torch.no_grad():
        action = graph.actor(torch.from_numpy(seen)).numpy()
    offset = G1.default_joint_array if mode == "default" else description.targets[frames]
    target = G1.default_joint_array + description.action_scale * file(seen, frames)
    np.testing.assert_allclose(target, offset + description.action_scale * action, atol=1e-5)
    assert parity(graph, file, seen) <= 1e-5


def test_all_profiles_give_the_same_actions(motion, tmp_path):
    description, frames = _description(motion, "feedforward"), np.arange(12)
    seen = _observations(motion, frames, description)
    actions = [_export(p, description, tmp_path / p)[1](seen, frames) for p in PROFILES]
    for other in actions[1:]:
        np.testing.assert_allclose(other, actions[0], atol=1e-5)
    assert np.abs(actions[0]).max() > 0.1


def test_holosoma_has_its_terms_in_alphabetical_order(motion, tmp_path):
    description = _description(motion)
    graph, file, _ = _export("holosoma", description, tmp_path)
    names = [name for name, _ in graph.terms]
    assert names == [
        "actions", "base_ang_vel", "dof_pos", "dof_vel", "motion_command", "motion_ref_ori_b",
    ]  # fmt: skip
    seen = _observations(motion, [4], description)
    parts = {name: seen[0, term.slice] for name, term in graph.terms}
    theirs = np.concatenate([parts[name] for name in sorted(parts)])
    assert theirs.shape == (154,)
    out = file.run(theirs, 4)
    np.testing.assert_allclose(out["actions"], file(seen, np.array([4])), atol=1e-6)
    starts = [t["start"] for t in description.sidecar(graph.terms)["observation"]["terms"]]
    assert starts == [0, 29, 32, 61, 90, 148]


def test_holosomas_motion_is_the_torsos_and_ends_at_its_last_frame(motion, tmp_path):
    _, file, _ = _export("holosoma", _description(motion), tmp_path)
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
    assert onnx.load(tmp_path / "policy.onnx").opset_import[0].version == 13


def test_holosomas_metadata_is_json_with_gains_and_robot(motion, tmp_path):
    _, file, _ = _export("holosoma", _description(motion), tmp_path)
    data = {key: json.loads(value) for key, value in file.metadata.items()}
    assert data["dof_names"] == list(G1.joint_names)
    assert data["kp"] == [a.stiffness for a in G1.actuators]
    assert data["kd"] == [a.damping for a in G1.actuators]
    assert data["action_scale"] == G1.action_scale.tolist()
    assert data["robot_urdf"].startswith("<robot") and data["robot_urdf_path"] == "g1.urdf"


def test_unitree_gets_three_files(motion, tmp_path):
    description = _description(motion, "residual")
    _, file, files = _export("unitree", description, tmp_path)
    assert [f.name for f in files] == ["policy.onnx", "deploy.yaml", "motion.npz"]
    assert file.outputs == ("actions",)
    deploy = yaml.safe_load(files[1].read_text())
    assert deploy["joint_ids_map"] == list(range(29)) and deploy["step_dt"] == 0.02
    action = deploy["actions"]["JointPositionAction"]
    assert action["scale"] == G1.action_scale.tolist()
    assert action["offset"] == deploy["default_joint_pos"] == G1.default_joint_array.tolist()
    assert deploy["stiffness"] == [a.stiffness for a in G1.actuators]
    assert list(deploy["observations"]) == [
        "motion_command", "motion_anchor_ori_b", "base_ang_vel", "joint_pos_rel", "joint_vel_rel",
        "last_action",
    ]  # fmt: skip
    sizes = [len(term["scale"]) for term in deploy["observations"].values()]
    assert sizes == [58, 6, 3, 29, 29, 29]
    played = load_motion(files[2])
    np.testing.assert_allclose(played.qpos, motion.qpos, atol=1e-6)


def test_unitrees_feedforward_knows_the_frame_by_the_command(motion, tmp_path):
    description = _description(motion, "feedforward")
    graph, file, _ = _export("unitree", description, tmp_path)
    for frame in range(12):
        seen = _observations(motion, [frame], description)
        with torch.no_grad():
            action = graph.actor(torch.from_numpy(seen)).numpy()
        target = G1.default_joint_array + description.action_scale * file(seen, np.array([0]))
        expected = description.targets[frame] + description.action_scale * action
        np.testing.assert_allclose(target, expected, atol=1e-5)


@pytest.mark.parametrize("profile", ["holosoma", "unitree"])
def test_what_a_stack_would_feed_otherwise_is_refused(motion, profile):
    for options, message in (
        ({"observation": {}}, "160 numbers, with estimated position and velocity"),
        ({"anchor": "pelvis"}, "the pelvis compared with the motion, not torso_link"),
    ):
        description = _description(motion, **options)
        with pytest.raises(InvalidOptionError, match=f"Profile '{profile}': .*{message}"):
            WRITERS[profile].graph(_actor(description.layout.size, 29), description)


def test_unitree_is_for_the_g1(tmp_path):
    robot = get_robot("t1")
    standing = reference_from_qpos(robot, 50.0, np.tile(robot.default_qpos, (5, 1)))
    description = _description(standing, robot=robot)
    with pytest.raises(InvalidOptionError, match=r"known for the Unitree G1 alone; .* Booster T1"):
        WRITERS["unitree"].graph(_actor(124, 23), description)
    assert _export("holosoma", description, tmp_path)[1].observation_size == 124


def test_a_motion_at_another_rate_does_not_fit_unitree(motion, tmp_path):
    slow = replace(motion, fps=30.0)
    with pytest.raises(InvalidOptionError, match="50 frames per second"):
        _export("unitree", _description(slow), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_an_order_that_is_none_is_refused(motion, tmp_path):
    _, _, files = _export("holosoma", _description(motion), tmp_path)
    for text in ("[0, 0, 1]", "{", "3"):
        model = onnx.load(files[0])
        onnx.helper.set_model_props(model, {"omni_envs_observation_order": text})
        onnx.save(model, tmp_path / "other.onnx")
        with pytest.raises(FileFormatError, match="omni_envs_observation_order"):
            OnnxPolicy(tmp_path / "other.onnx")
