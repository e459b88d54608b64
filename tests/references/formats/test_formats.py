import os
from pathlib import Path

import numpy as np
import pytest

from omni_envs.errors import FileFormatError, UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.references.formats import load_motion
from omni_envs.robots import G1

SHARED = Path(os.environ.get("OMNI_ENVS_SHARED", Path(__file__).parents[4] / "shared"))


@pytest.fixture
def motion(smooth_qpos, smooth_object):
    return smooth_qpos(), smooth_object()


def quaternion_first(poses):
    return np.concatenate([poses[:, 3:7], poses[:, :3], poses[:, 7:]], axis=1)


def rl_arrays(qpos, poses, joint_names, wrong=False):
    """A motion file, as the official converter writes it: with root and object in one world."""
    reference = reference_from_qpos(G1, 50.0, qpos)
    velocities = reference.body_linear_velocities
    if wrong:
        velocities = velocities + np.cross([0.0, 0.0, 2.0], reference.body_positions)
    order = [G1.joint_names.index(n) for n in joint_names]
    world = np.zeros((len(qpos), 1, 3))
    return {
        "fps": np.array([50]),
        "joint_pos": np.concatenate([qpos[:, :7], qpos[:, 7:][:, order]], axis=1),
        "joint_vel": reference.qvel,
        "body_pos_w": np.concatenate([world, reference.body_positions], axis=1),
        "body_lin_vel_w": np.concatenate([world, velocities], axis=1),
        "joint_names": np.array(joint_names),
        "body_names": np.array(["world", *reference.body_names]),
        "object_pos_w": poses[:, :3],
        "object_quat_w": poses[:, 3:],
    }


def test_retargeter_output(motion, tmp_path):
    qpos, poses = motion
    human = np.zeros((40, 52, 3), np.float32)
    np.savez(
        tmp_path / "m.npz", qpos=np.hstack([qpos, poses]), fps=30, cost=0.5, human_joints=human
    )
    found = load_motion(tmp_path / "m.npz")
    assert (found.format, found.robot, found.fps) == ("holosoma_retargeter", G1, 30.0)
    np.testing.assert_allclose(found.qpos, qpos, atol=1e-12)
    np.testing.assert_allclose(found.object_poses, poses, atol=1e-12)
    assert found.human_joints.shape == (40, 52, 3)


def test_dataset_file_has_its_quaternions_first(motion, tmp_path):
    qpos, poses = motion
    rows = np.hstack([quaternion_first(qpos), quaternion_first(poses)])
    np.savez(tmp_path / "m.npz", qpos=rows, fps=30.0)
    found = load_motion(tmp_path / "m.npz")
    assert found.format == "omniretarget_dataset"
    np.testing.assert_allclose(found.qpos, qpos, atol=1e-12)
    np.testing.assert_allclose(found.object_poses, poses, atol=1e-12)


def test_without_object(motion, tmp_path):
    np.savez(tmp_path / "m.npz", qpos=motion[0], fps=30.0)
    assert load_motion(tmp_path / "m.npz").object_poses is None


def test_rl_motion_is_read_by_the_names_of_its_joints(motion, tmp_path, recwarn):
    qpos, poses = motion
    np.savez(tmp_path / "m.npz", **rl_arrays(qpos, poses, G1.joint_names[::-1]))
    found = load_motion(tmp_path / "m.npz")
    assert (found.format, found.fps) == ("holosoma_motion", 50.0)
    np.testing.assert_allclose(found.qpos, qpos, atol=1e-12)
    np.testing.assert_allclose(found.object_poses, poses, atol=1e-12)
    assert not recwarn.list


def test_wrong_body_velocities_are_noticed(motion, tmp_path):
    arrays = rl_arrays(*motion, G1.joint_names, wrong=True)
    np.savez(tmp_path / "m.npz", **arrays)
    with pytest.warns(UserWarning, match="contradict the poses"):
        load_motion(tmp_path / "m.npz")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"qpos": np.zeros((40, 12))}, "qpos"),
        ({"qpos": np.zeros((40, 36))}, "qpos"),
        ({"qpos": np.zeros(36)}, "qpos"),
        ({"qpos": np.full((40, 36), np.nan)}, "qpos"),
        ({"qpos": np.array(["a"])}, "qpos"),
        ({"fps": 0.0}, "fps"),
        ({"fps": "fast"}, "fps"),
        ({"fps": []}, "fps"),
        ({"fps": 1e12}, "fps"),
        ({"fps": [30.0, 30.0]}, "fps"),
    ],
)
def test_bad_files_are_refused(motion, tmp_path, change, field):
    np.savez(tmp_path / "m.npz", **{"qpos": motion[0], "fps": 30.0, **change})
    with pytest.raises(FileFormatError, match=rf"m\.npz: {field}"):
        load_motion(tmp_path / "m.npz")


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"joint_names": np.array(["a", "b"])}, "joint_names"),
        ({"joint_pos": np.zeros((40, 29))}, "joint_pos"),
        ({"object_quat_w": np.zeros((40, 4))}, "object_quat_w"),
        ({"object_quat_w": np.zeros((39, 4))}, "object_quat_w"),
        ({"body_lin_vel_w": np.zeros((40, 2, 3))}, "body_lin_vel_w"),
    ],
)
def test_bad_rl_motions_are_refused(motion, tmp_path, change, field):
    np.savez(tmp_path / "m.npz", **{**rl_arrays(*motion, G1.joint_names), **change})
    with pytest.raises(FileFormatError, match=rf"m\.npz: {field}"):
        load_motion(tmp_path / "m.npz")


def test_other_files_are_refused(tmp_path):
    np.savez(tmp_path / "m.npz", poses=np.zeros(3))
    with pytest.raises(FileFormatError, match="poses"):
        load_motion(tmp_path / "m.npz")
    (tmp_path / "m.npz").write_bytes(b"PK")
    with pytest.raises(FileFormatError, match=r"m\.npz"):
        load_motion(tmp_path / "m.npz")
    with pytest.raises(UnknownNameError, match="r2d2"):
        load_motion(tmp_path / "m.npz", "r2d2")


@pytest.mark.skipif(not (SHARED / "anchors").is_dir(), reason=f"no anchors in {SHARED}")
class TestAnchors:
    def test_official_files_are_recognised(self):
        folder = SHARED / "anchors"
        names = {
            "official_runs/sub3_largebox_003_original.npz": ("holosoma_retargeter", 196, True),
            "official_runs/mocap_climb_seq_1_original.npz": ("holosoma_retargeter", 606, False),
            "omniretarget_dataset/robot-object/sub10_largebox_000_original.npz": (
                "omniretarget_dataset",
                120,
                True,
            ),
            "omniretarget_dataset/robot-terrain/climb_00_z_scale_0.8.npz": (
                "omniretarget_dataset",
                604,
                False,
            ),
        }
        for name, (kind, frames, has_object) in names.items():
            motion = load_motion(folder / name)
            assert (motion.format, len(motion.qpos), motion.fps) == (kind, frames, 30.0)
            assert (motion.object_poses is not None) == has_object
            assert 0.3 < motion.qpos[:, 2].mean() < 1.5  # standing on or above the ground

    def test_official_rl_motions_carry_wrong_velocities(self):
        path = SHARED / "anchors/official_rl_motions/sub3_largebox_003_mj_w_obj.npz"
        with pytest.warns(UserWarning, match="contradict the poses"):
            motion = load_motion(path)
        reference = reference_from_qpos(motion.robot, motion.fps, motion.qpos)
        with np.load(path) as file:
            stored = file["joint_vel"], file["body_ang_vel_w"][:, 1]
        # Hinges and root linear velocity are right in these files, the root's angular one is not.
        np.testing.assert_allclose(reference.qvel[2:-2, 6:], stored[0][2:-2, 6:], atol=0.15)
        np.testing.assert_allclose(reference.qvel[2:-2, :3], stored[0][2:-2, :3], atol=0.05)
        error = reference.body_angular_velocities[:, 0] - stored[1]
        assert np.sqrt(np.mean(np.sum(error[2:-2] ** 2, axis=1))) > 1.0
