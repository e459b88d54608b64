import zipfile

import numpy as np
import pytest

from omni_envs.demonstrations.arrays import map_npy, read_npz_members
from omni_envs.errors import FileFormatError


def test_members_are_read_as_numpy_would(tmp_path):
    path = tmp_path / "a.npz"
    stored = {
        "c": np.arange(24.0).reshape(2, 3, 4),
        "f": np.asfortranarray(np.arange(6, dtype=np.int16).reshape(2, 3)),
        "text": np.array(["left", "right"]),
        "scalar": np.array(30.0),
    }
    np.savez_compressed(path, **stored, code=np.array([{"a": 1}], dtype=object))
    found, names = read_npz_members(path)
    assert set(names) == {*stored, "code"} and set(found) == {*stored}
    for name, array in stored.items():
        np.testing.assert_array_equal(found[name], array)
    assert set(read_npz_members(path, ("c", "missing"))[0]) == {"c"}


def test_a_shape_larger_than_the_file_takes_no_memory(tmp_path):
    path = tmp_path / "a.npz"
    for frames, match in ((10**5, "expected 127200000 bytes"), (10**6, "at most 512 MiB")):
        shape = b"{'descr': '<f8', 'fortran_order': False, 'shape': (%d, 53, 3), }" % frames
        header = b"\x93NUMPY\x01\x00v\x00" + shape.ljust(117) + b"\n"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("positions.npy", header)
        with pytest.raises(FileFormatError, match=f"array 'positions': .*{match}"):
            read_npz_members(path)
        (tmp_path / "a.npy").write_bytes(header)
        with pytest.raises(FileFormatError, match=r"a\.npy: content"):
            map_npy(tmp_path / "a.npy", "an array")


def test_npy_is_mapped_not_read(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((4, 2, 3)))
    assert isinstance(map_npy(tmp_path / "a.npy", "an array"), np.memmap)


@pytest.mark.parametrize(
    ("content", "found"),
    [(b"", "an empty file"), (b"\x80\x04K\x01.", "a pickle"), (b"PK\x03\x04", "a .npz archive")],
)
def test_other_files_are_called_by_name(tmp_path, content, found):
    (tmp_path / "a.npy").write_bytes(content)
    with pytest.raises(FileFormatError, match=f"expected an array; found {found}"):
        map_npy(tmp_path / "a.npy", "an array")


def test_objects_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(FileFormatError, match="content"):
        map_npy(tmp_path / "a.npy", "an array")
