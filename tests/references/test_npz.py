import multiprocessing
import os
import signal
import time

import numpy as np
import pytest

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.references import npz


@pytest.fixture
def arrays():
    return {
        "a": np.arange(60.0).reshape(20, 3),
        "flag": np.array([True, False]),
        "text": np.array("é"),
    }


def test_round_trip(tmp_path, arrays):
    path = npz.write_npz(tmp_path / "new" / "file.npz", arrays)
    back = npz.read_npz(path)
    assert back.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)
        assert back[name].dtype == array.dtype
    assert [p.name for p in path.parent.iterdir()] == ["file.npz"]


def test_the_same_content_gives_the_same_bytes(tmp_path, arrays):
    first, second = (npz.write_npz(tmp_path / f"{i}.npz", arrays) for i in range(2))
    assert first.read_bytes() == second.read_bytes()


def test_python_objects_are_neither_written_nor_read(tmp_path):
    with pytest.raises(InvalidDataError, match="bad"):
        npz.write_npz(tmp_path / "file.npz", {"bad": np.array([{}, None], dtype=object)})
    assert not list(tmp_path.iterdir())
    np.savez(tmp_path / "pickle.npz", bad=np.array([{}], dtype=object))
    with pytest.raises(FileFormatError, match=r"pickle\.npz"):
        npz.read_npz(tmp_path / "pickle.npz")


@pytest.mark.parametrize("keep", [0.0, 0.3, 0.5, 0.9, 0.999])
def test_a_file_cut_short_is_refused(tmp_path, arrays, keep):
    path = npz.write_npz(tmp_path / "file.npz", arrays)
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data))])
    with pytest.raises(FileFormatError, match=r"file\.npz"):
        npz.read_npz(path)


def test_any_damaged_byte_is_refused_or_harmless(tmp_path, arrays):
    path = npz.write_npz(tmp_path / "file.npz", arrays)
    good = path.read_bytes()
    for place in range(0, len(good), 11):
        bad = bytearray(good)
        bad[place] ^= 0x55
        path.write_bytes(bad)
        try:
            back = npz.read_npz(path)
        except FileFormatError:
            continue
        for name, array in arrays.items():  # a byte that nobody reads, e.g. a time stamp
            np.testing.assert_array_equal(back[name], array)


def test_changed_content_is_refused(tmp_path, arrays):
    path = npz.write_npz(tmp_path / "file.npz", arrays)
    with np.load(path) as file:
        content = dict(file)
    content["a"] = content["a"] + 1
    np.savez(path, **content)
    with pytest.raises(FileFormatError, match="damaged"):
        npz.read_npz(path)


def test_files_of_others_have_no_hash(tmp_path, arrays):
    np.savez(tmp_path / "file.npz", **arrays)
    with pytest.raises(FileFormatError, match=npz.DIGEST):
        npz.read_npz(tmp_path / "file.npz")
    assert npz.read_npz(tmp_path / "file.npz", checked=False).keys() == arrays.keys()


@pytest.mark.parametrize("kind", ["missing", "folder", "text", "npy"])
def test_other_things_are_refused(tmp_path, kind):
    path = tmp_path / "file.npz"
    if kind == "folder":
        path.mkdir()
    elif kind == "text":
        path.write_text("hello")
    elif kind == "npy":
        with open(path, "wb") as file:
            np.save(file, np.zeros(3))
    with pytest.raises(FileFormatError, match=r"file\.npz") as error:
        npz.read_npz(path)
    assert "pickle" not in str(error.value)  # NumPy would speak of them


def _write_forever(path, started):
    arrays = {"a": np.random.default_rng(0).normal(size=(400, 1000))}
    while True:
        npz.write_npz(path, arrays)
        started.set()


def test_a_killed_writer_leaves_a_whole_file(tmp_path):
    context = multiprocessing.get_context("spawn")
    started, path = context.Event(), tmp_path / "file.npz"
    writer = context.Process(target=_write_forever, args=(path, started))
    writer.start()
    assert started.wait(60)
    time.sleep(0.05)
    os.kill(writer.pid, signal.SIGKILL)
    writer.join()
    assert npz.read_npz(path)["a"].shape == (400, 1000)
