import numpy as np
import pytest
import trimesh

from omni_envs.demonstrations import MOCAP, load_mocap
from omni_envs.errors import FileFormatError


def write(folder, frames=9, name="climb.npy"):
    data = np.arange(frames * 53 * 3, dtype=np.float32).reshape(frames, 53, 3) * 1e-3
    np.save(folder / name, data)
    return folder / name, data


def test_every_fourth_frame_is_kept(tmp_path):
    path, data = write(tmp_path)
    demo = load_mocap(path)
    assert demo.fps == 30 and demo.height == 1.78 and demo.joint_names == MOCAP.joint_names
    np.testing.assert_array_equal(demo.positions, data[::4])
    assert demo.scene.terrain is None and demo.object_poses is None


def test_terrain_beside_the_file_without_slabs_below_ground(tmp_path):
    path, _ = write(tmp_path)
    (tmp_path / "box_models").mkdir()
    step = trimesh.creation.box(extents=[1, 1, 0.2]).apply_translation([0, 0, 0.1])
    slab = trimesh.creation.box(extents=[20, 20, 0.1]).apply_translation([0, 0, -0.05])
    step.export(tmp_path / "box_models/box1.obj")
    slab.export(tmp_path / "box_models/box2.obj")
    (part,) = load_mocap(path).scene.terrain.parts
    np.testing.assert_allclose(part.position, (0, 0, 0.1), atol=1e-6)
    step.export(tmp_path / "other.obj")
    assert len(load_mocap(path, terrain_mesh=tmp_path / "other.obj").scene.terrain.parts) == 1


def test_recorded_climb(shared):
    (path,) = (shared / "data/climb/seq_1").glob("*.npy")
    demo = load_mocap(path)
    assert demo.num_frames == 606
    assert sorted(round(float(p.mesh().extents[2]), 3) for p in demo.scene.terrain.parts) == [
        0.18,
        0.95,
    ]


@pytest.mark.parametrize("shape", [(0, 53, 3), (5, 52, 3), (5, 53), (5, 53, 4)])
def test_wrong_shape(tmp_path, shape):
    np.save(tmp_path / "x.npy", np.zeros(shape))
    with pytest.raises(FileFormatError, match=r"\(T, 53, 3\).*shape"):
        load_mocap(tmp_path / "x.npy")


def test_nan_names_the_frame(tmp_path):
    path, data = write(tmp_path)
    data[5, 7, 1] = np.nan
    np.save(path, data)
    with pytest.raises(FileFormatError, match="frame 5"):
        load_mocap(path)


@pytest.mark.parametrize("keep", [0, 40, 200])
def test_truncated(tmp_path, keep):
    path, _ = write(tmp_path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(FileFormatError, match=r"climb\.npy"):
        load_mocap(path)


def test_pickled_objects_are_refused(tmp_path):
    np.save(tmp_path / "x.npy", np.array([{"a": 1}], object), allow_pickle=True)
    with pytest.raises(FileFormatError, match=r"x\.npy: content"):
        load_mocap(tmp_path / "x.npy")


def test_missing(tmp_path):
    with pytest.raises(FileFormatError, match="existing"):
        load_mocap(tmp_path / "x.npy")
    path, _ = write(tmp_path)
    with pytest.raises(FileFormatError, match=r"nowhere\.obj"):
        load_mocap(path, terrain_mesh=tmp_path / "nowhere.obj")
