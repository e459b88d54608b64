"""What we write for other projects, we read back as it was."""

import numpy as np
import pytest

from omni_envs.errors import FileFormatError, InvalidOptionError
from omni_envs.references import MOTION_FORMATS, load_motion, reference_from_qpos, save_motion
from omni_envs.references.formats.tracking import body_places, joint_places
from omni_envs.robots import G1, get_robot
from omni_envs.scenes import Box, Part, Scene, SceneObject

WITH_OBJECT = {"omniretarget_dataset", "holosoma_retargeter", "holosoma_motion"}
SINGLE = {"unitree_deploy"}
BOX = Scene(object=SceneObject("box", (Part(Box((0.1, 0.2, 0.3))),)))


def suffix(name):
    return MOTION_FORMATS[name].suffix


@pytest.fixture
def reference(smooth_qpos, smooth_object):
    return reference_from_qpos(G1, 50.0, smooth_qpos(), smooth_object(), BOX)


@pytest.fixture
def alone(smooth_qpos):
    return reference_from_qpos(G1, 50.0, smooth_qpos())


@pytest.mark.parametrize("name", MOTION_FORMATS)
def test_round_trip_is_exact(alone, name, tmp_path, recwarn):
    path = save_motion(alone, tmp_path / "new" / f"m{suffix(name)}", name)
    found = load_motion(path, fps=50.0 if name == "unitree_csv" else None)
    assert (found.format, found.robot, found.fps) == (name, G1, 50.0)
    exact = alone.qpos.astype(np.float32) if name in SINGLE else alone.qpos
    np.testing.assert_array_equal(found.qpos, exact)
    assert found.object_poses is None
    assert not recwarn.list
    assert [p.name for p in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize("name", sorted(WITH_OBJECT))
def test_object_is_included(reference, name, tmp_path):
    found = load_motion(save_motion(reference, tmp_path / "m.npz", name))
    assert found.format == name
    np.testing.assert_array_equal(found.qpos, reference.qpos)
    np.testing.assert_array_equal(found.object_poses, reference.object_poses)


@pytest.mark.parametrize("robot", ["h1", "t1"])
@pytest.mark.parametrize("name", MOTION_FORMATS)
def test_other_robots(robot, name, tmp_path):
    robot = get_robot(robot)
    qpos = np.tile(robot.default_qpos, (30, 1))
    phase = np.arange(robot.num_joints)
    qpos[:, 7:] += 0.3 * np.sin(0.1 * np.arange(30)[:, None] + phase)
    made = reference_from_qpos(robot, 50.0, qpos)
    found = load_motion(save_motion(made, tmp_path / f"m{suffix(name)}", name), robot)
    assert found.format == name
    np.testing.assert_allclose(found.qpos, qpos, atol=1e-6 if name in SINGLE else 0)


def test_breadth_first_goes_level_by_level():
    names = [G1.joint_names[i] for i in joint_places(G1, True)]
    assert names[:6] == [
        "left_hip_pitch_joint", "right_hip_pitch_joint", "waist_yaw_joint",
        "left_hip_roll_joint", "right_hip_roll_joint", "waist_roll_joint",
    ]  # fmt: skip
    assert sorted(names) == sorted(G1.joint_names)
    bodies = [G1.body_names[i] for i in body_places(G1, True)]
    assert bodies[0] == "pelvis" and sorted(bodies) == sorted(G1.body_names)


@pytest.mark.parametrize("name", ["mjlab", "beyondmimic"])
def test_order_without_names_is_told_by_the_bodies(alone, name, tmp_path):
    arrays = MOTION_FORMATS[name].arrays(alone, G1)
    del arrays["joint_names"], arrays["body_names"]
    np.savez(tmp_path / "m.npz", **arrays)
    found = load_motion(tmp_path / "m.npz")
    assert found.format == name
    np.testing.assert_array_equal(found.qpos, alone.qpos)
    arrays["joint_pos"] = arrays["joint_pos"][:, ::-1]
    np.savez(tmp_path / "m.npz", **arrays)
    with pytest.raises(FileFormatError, match=r"joint_pos: .*breadth first.*neither"):
        load_motion(tmp_path / "m.npz")


def test_velocities_are_those_of_the_poses(smooth_qpos, tmp_path):
    """A yawed clip has the same velocities in the frame of its bodies."""
    files = []
    for yaw in (0.0, 2.0):
        made = reference_from_qpos(G1, 50.0, smooth_qpos(yaw=yaw))
        path = save_motion(made, tmp_path / f"{yaw}.npz", "holosoma_motion")
        with np.load(path) as file:
            files.append({k: file[k] for k in file.files})
    first, turned = files
    np.testing.assert_allclose(first["joint_vel"][:, 3:], turned["joint_vel"][:, 3:], atol=1e-9)
    speeds = [np.linalg.norm(f["body_lin_vel_w"], axis=-1) for f in files]
    np.testing.assert_allclose(*speeds, atol=1e-9)
    assert first["body_names"][0] == "world" and first["fps"] == np.array([50])


def test_what_a_format_cannot_hold_is_refused(reference, smooth_qpos, tmp_path):
    with pytest.raises(InvalidOptionError, match=r"unitree_csv.*no place for the object"):
        save_motion(reference, tmp_path / "m.csv", "unitree_csv")
    slow = reference_from_qpos(G1, 30.0, smooth_qpos())
    with pytest.raises(InvalidOptionError, match="50 frames per second"):
        save_motion(slow, tmp_path / "m.npz", "unitree_deploy")
    odd = reference_from_qpos(G1, 29.97, smooth_qpos())
    with pytest.raises(InvalidOptionError, match="whole number"):
        save_motion(odd, tmp_path / "m.npz", "mjlab")
    with pytest.raises(InvalidOptionError, match="expected one of omniretarget_dataset"):
        save_motion(slow, tmp_path / "m.npz", "fbx")
    with pytest.raises(InvalidOptionError, match=r"end in \.csv"):
        save_motion(slow, tmp_path / "m.npz", "unitree_csv")
    assert not list(tmp_path.iterdir())


def test_rate_is_asked_only_where_the_file_lacks_it(alone, tmp_path):
    path = save_motion(alone, tmp_path / "m.csv", "unitree_csv")
    assert load_motion(path).fps == 30.0
    assert load_motion(path, fps=120.0).fps == 120.0
    with pytest.raises(InvalidOptionError, match="1 to 1000 frames"):
        load_motion(path, fps=0.0)
    path = save_motion(alone, tmp_path / "m.npz", "mjlab")
    with pytest.raises(InvalidOptionError, match="tells its own"):
        load_motion(path, fps=30.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "an empty file"),
        ("\n\n", "rows"),
        ("1,2,3\n1,2\n", "comma-separated"),
        ("a,b\n", "comma-separated"),
        ("1,2,3\n", "36 columns"),
        (",".join(["nan"] * 36), "finite"),
        (",".join(["0.0"] * 36), "unit quaternions"),
        ("\x00\xff", "rows"),
    ],
)
@pytest.mark.filterwarnings("ignore:loadtxt")
def test_bad_tables_are_refused(tmp_path, content, message):
    path = tmp_path / "m.csv"
    path.write_text(content, encoding="latin-1")
    with pytest.raises(FileFormatError, match=rf"m\.csv: .*{message}"):
        load_motion(path)


def test_missing_table(tmp_path):
    with pytest.raises(FileFormatError, match="existing"):
        load_motion(tmp_path / "none.csv")
