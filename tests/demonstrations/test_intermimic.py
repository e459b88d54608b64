import pickle

import numpy as np
import pytest
import trimesh

from omni_envs.demonstrations import (
    SMPLH,
    SourceOptions,
    closest_points,
    intermimic,
    load_intermimic,
)
from omni_envs.demonstrations.intermimic import LARGEBOX
from omni_envs.errors import FileFormatError
from omni_envs.scenes import Box

torch = pytest.importorskip("torch", reason="InterMimic files are read with PyTorch")


def write(folder, data, name="sub3_largebox_003.pt"):
    path = folder / name
    torch.save(torch.as_tensor(data), path)
    return path


def test_columns_and_conventions(tmp_path, intermimic_array):
    demo = load_intermimic(write(tmp_path, intermimic_array))
    assert demo.fps == 30 and demo.height == 1.9411 and demo.num_frames == 6
    assert demo.joint_names == SMPLH.joint_names
    np.testing.assert_allclose(
        demo.positions[2].ravel(), intermimic_array[2, 162:318], rtol=0, atol=0
    )
    np.testing.assert_allclose(
        demo.object_poses[0], [1, 0.5, 0.2, np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-6
    )
    np.testing.assert_array_equal(demo.orientations[0, 0], [1, 0, 0, 0])
    assert demo.contacts["left_hand"].tolist() == [False] * 4 + [True, False]
    assert not demo.contacts["right_hand"].any()  # −1 is unknown, not contact


def test_mesh_beside_the_file_is_the_object(tmp_path, intermimic_array):
    trimesh.creation.box(extents=[0.3, 0.4, 0.5]).export(tmp_path / "suitcase.obj")
    demo = load_intermimic(write(tmp_path, intermimic_array, "sub10_suitcase_001.pt"))
    assert demo.height == 1.6510 and demo.scene.object.name == "suitcase"
    np.testing.assert_allclose(
        demo.scene.object.parts[0].shape.half_extents, (0.15, 0.2, 0.25), atol=1e-6
    )


def test_largebox_is_known_without_its_mesh(tmp_path, intermimic_array):
    demo = load_intermimic(write(tmp_path, intermimic_array))
    (part,) = demo.scene.object.parts
    assert isinstance(part.shape, Box)
    np.testing.assert_allclose(part.mesh().extents, (0.471, 0.459, 0.408), atol=0.05)


def test_largebox_matches_its_scan(shared):
    clip = shared / "data/omomo/sub3_largebox_003.pt"
    (scan,) = load_intermimic(clip).scene.object.parts  # the mesh lies beside the clip
    assert len(scan.shape.vertices) <= 256
    known = closest_points([LARGEBOX], scan.shape.vertices)[1]
    assert known.max() < 1e-3  # the box holds the scan, which is dented and round at the edges
    assert known.min() > -0.02
    assert 0.9 < scan.mesh().volume / LARGEBOX.mesh().volume < 1.0


@pytest.mark.parametrize("keep", [0, 20, 1000, 5000])
def test_truncated_file(tmp_path, intermimic_array, keep):
    path = write(tmp_path, intermimic_array)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(FileFormatError, match=r"sub3_largebox_003\.pt: content") as error:
        load_intermimic(path)
    assert "\n" not in str(error.value)


def test_files_that_are_too_large_are_not_read(tmp_path, intermimic_array, monkeypatch):
    monkeypatch.setattr(intermimic, "_MAX_BYTES", 1000)
    with pytest.raises(FileFormatError, match="file: expected at most"):
        load_intermimic(write(tmp_path, intermimic_array))


def test_a_part(tmp_path, intermimic_array):
    path = write(tmp_path, intermimic_array)
    part = load_intermimic(path, SourceOptions(start=0.05, end=0.15))
    assert part.num_frames == 3 and len(part.object_poses) == 3
    np.testing.assert_array_equal(part.positions, load_intermimic(path).positions[2:5])
    with pytest.raises(FileFormatError, match="start, end"):
        load_intermimic(path, SourceOptions(start=9.0))


def test_missing_file(tmp_path):
    with pytest.raises(FileFormatError, match=r"absent_x_1\.pt.*existing"):
        load_intermimic(tmp_path / "absent_x_1.pt")


class _Mischief:
    def __reduce__(self):
        return (print, ("this must never run",))


def test_pickled_code_is_refused_and_never_runs(tmp_path, capsys):
    plain = tmp_path / "sub3_largebox_003.pt"
    plain.write_bytes(pickle.dumps(_Mischief()))
    saved = tmp_path / "sub3_largebox_004.pt"
    torch.save(_Mischief(), saved)
    for path in (plain, saved):
        with pytest.raises(FileFormatError, match="content"):
            load_intermimic(path)
    assert "never run" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (np.zeros((0, 591), np.float32), r"shape \(0, 591\)"),
        (np.zeros((5, 590), np.float32), r"shape \(5, 590\)"),
        (np.zeros(591, np.float32), r"shape \(591,\)"),
    ],
)
def test_wrong_shape(tmp_path, data, found):
    with pytest.raises(FileFormatError, match=found):
        load_intermimic(write(tmp_path, data))


def test_dictionary_instead_of_tensor(tmp_path):
    path = tmp_path / "sub3_largebox_003.pt"
    torch.save({"a": torch.zeros(3)}, path)
    with pytest.raises(FileFormatError, match="found dict"):
        load_intermimic(path)


@pytest.mark.parametrize(
    ("column", "field"), [(200, "joint positions"), (319, "object pose"), (400, "joint rotations")]
)
def test_nan_names_field_and_frame(tmp_path, intermimic_array, column, field):
    intermimic_array[3, column] = np.nan
    with pytest.raises(FileFormatError, match=f"{field}.*frame 3"):
        load_intermimic(write(tmp_path, intermimic_array))


def test_unknown_subject_needs_a_height(tmp_path, intermimic_array):
    path = write(tmp_path, intermimic_array, "sub99_largebox_001.pt")
    with pytest.raises(FileFormatError, match="height="):
        load_intermimic(path)
    assert load_intermimic(path, SourceOptions(height=1.7)).height == 1.7


def test_unknown_object_is_an_error(tmp_path, intermimic_array):
    path = write(tmp_path, intermimic_array, "sub3_lamp_001.pt")
    with pytest.raises(FileFormatError, match=r"object_mesh=.*lamp\.obj"):
        load_intermimic(path)
