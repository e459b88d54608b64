"""Damaged files of every format: one clear error, never another exception."""

import json
import pickle
import zipfile
from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from omni_envs.demonstrations import load_demonstration, read_skeleton_map
from omni_envs.errors import FileFormatError, OmniEnvsError

fuzz = settings(
    derandomize=True,
    deadline=None,
    max_examples=80,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

# An edit: where (as a fraction of the file), how many bytes go, and what comes instead.
edits = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 40), st.binary(max_size=12)), min_size=1, max_size=4
)
words = st.sampled_from(
    ["nan", "inf", "-1", "0", "1e999", "999999999", "{", "}", "End", "JOINT", "OFFSET", "CHANNELS",
     "Frames:", "MOTION", "\x00", "é", "[", "null", "\"", ":", "''", "(10**9,)", "|O"]
)  # fmt: skip
word_edits = st.lists(st.tuples(st.floats(0, 1), words), min_size=1, max_size=4)


def edited(data: bytes, changes) -> bytes:
    for place, count, insert in changes:
        at = int(place * len(data))
        data = data[:at] + insert + data[at + count :]
    return data


def with_words(data: bytes, changes) -> bytes:
    """Replaces whole words, which hits the numbers and names of text formats."""
    parts = data.decode("latin-1").split(" ")
    for place, word in changes:
        parts[min(int(place * len(parts)), len(parts) - 1)] = word
    return " ".join(parts).encode("utf-8")


def check(path, data, load):
    """Loads the data: it works, or says in one line what is wrong with this file."""
    path.write_bytes(data)
    try:
        load(path)
    except OmniEnvsError as error:
        message = str(error)
        assert "\n" not in message and len(message) < 3000
        if isinstance(error, FileFormatError):
            assert path.name in message or "body" in message


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.fixture
def bvh(person, write_bvh):
    return write_bvh(person(fps=30.0, seconds=0.2)).read_bytes()


@fuzz
@given(changes=edits)
@example(changes=[(0.0, 10**6, b"")])
def test_bvh_bytes(bvh, folder, changes):
    check(folder / "clip.bvh", edited(bvh, changes), load_demonstration)


@fuzz
@given(changes=word_edits)
def test_bvh_words(bvh, folder, changes):
    check(folder / "clip.bvh", with_words(bvh, changes), load_demonstration)


@pytest.fixture
def humanoid():
    row = [1 / 30, 0, 0.88, 0, *[1, 0, 0, 0] * 3, *([1, 0, 0, 0, 0] + [1, 0, 0, 0] * 2 + [0]) * 2]
    return json.dumps({"Loop": "wrap", "Frames": [row] * 4}).encode()


@fuzz
@given(changes=edits)
def test_deepmimic_bytes(humanoid, folder, changes):
    check(folder / "clip.txt", edited(humanoid, changes), load_demonstration)


@fuzz
@given(changes=word_edits)
def test_deepmimic_words(humanoid, folder, changes):
    check(folder / "clip.json", with_words(humanoid, changes), load_demonstration)


@fuzz
@given(changes=edits, squeeze=st.booleans())
def test_joint_archives(person, folder, changes, squeeze):
    who = person(seconds=0.2)
    save = np.savez_compressed if squeeze else np.savez
    source = folder / "source.npz"
    save(source, positions=who.pose()[0], fps=30.0, joint_names=np.array(who.names))
    check(folder / "clip.npz", edited(source.read_bytes(), changes), load_demonstration)


@fuzz
@given(changes=edits, header_only=st.booleans(), joints=st.sampled_from([22, 53]))
def test_bare_arrays(person, folder, changes, header_only, joints):
    source = folder / "source.npy"
    np.save(source, np.resize(person(seconds=0.2).pose()[0], (7, joints, 3)))
    data = source.read_bytes()
    if header_only:
        changes = [(place * 100 / len(data), count % 8, insert) for place, count, insert in changes]
    load = partial(load_demonstration, fps=30.0)
    check(folder / "clip.npy", edited(data, changes), load)


@fuzz
@given(changes=edits, model_too=st.booleans())
def test_smpl_parameters(person, smpl_parameters, write_body, folder, changes, model_too):
    source, body = folder / "source.npz", write_body(folder / "body.npz")
    np.savez(source, **smpl_parameters(person(seconds=0.2)))
    data = source.read_bytes()
    if model_too:
        body.write_bytes(edited(body.read_bytes(), changes))
    else:
        data = edited(data, changes)
    check(folder / "clip.npz", data, partial(load_demonstration, body_model=body))


@fuzz
@given(changes=edits, names=st.lists(st.sampled_from(["obj_trans", "trans", "poses"]), max_size=2))
def test_omomo_sequences(person, smpl_parameters, folder, changes, names):
    who = person(seconds=0.2)
    arrays = smpl_parameters(who) | {
        "obj_trans": np.zeros((who.frames, 3, 1)),
        "obj_rot": np.tile(np.eye(3), (who.frames, 1, 1)),
        "obj_scale": np.ones(who.frames),
        "rest_offsets": np.ones((24, 3)),
        "trans2joint": np.zeros(3),
    }
    for name in names:  # anything else in place of a field
        arrays[name] = np.resize(arrays[name], (3, 2))
    source = folder / "sub3_largebox_001.npz"
    np.savez(source, **arrays)
    check(source, edited(source.read_bytes(), changes), load_demonstration)


@fuzz
@given(data=st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(
        st.sampled_from(["name", "keypoints", "contacts", "head_top", "joint_names", "pelvis",
                         "left_hand"]), inner, max_size=4), max_leaves=12,
))  # fmt: skip
def test_skeleton_maps(folder, data):
    check(folder / "map.yaml", json.dumps(data).encode(), read_skeleton_map)


@fuzz
@given(data=st.binary(max_size=60))
def test_skeleton_map_bytes(folder, data):
    check(folder / "map.yaml", data, read_skeleton_map)


@settings(fuzz, max_examples=30)
@given(changes=edits)
def test_intermimic(folder, intermimic_array, changes):
    torch = pytest.importorskip("torch")
    source = folder / "source.pt"
    torch.save(torch.as_tensor(intermimic_array), source)
    path = folder / "sub3_largebox_003.pt"
    check(path, edited(source.read_bytes(), changes), load_demonstration)


class _Mischief:
    def __reduce__(self):
        return (print, ("this must never run",))


@pytest.mark.parametrize(
    "name", ["a.npy", "a.npz", "a.bvh", "a.txt", "a.json", "sub3_largebox_1.pt", "a.p", "a.pkl"]
)
def test_pickled_code_never_runs(tmp_path, capsys, name):
    if name.endswith(".pt"):
        pytest.importorskip("torch")
    path = tmp_path / name
    path.write_bytes(pickle.dumps(_Mischief()))
    with pytest.raises(FileFormatError, match=name):
        load_demonstration(path)
    if name.endswith("npz"):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("positions.npy", pickle.dumps(_Mischief()))
        with pytest.raises(FileFormatError, match=name):
            load_demonstration(path)
        np.savez(path, positions=np.array([_Mischief()], dtype=object))
        with pytest.raises(FileFormatError, match="no objects"):
            load_demonstration(path)
    assert "never run" not in capsys.readouterr().out
