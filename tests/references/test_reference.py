import dataclasses

import numpy as np
import pytest

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.references import Reference, reference_from_qpos
from omni_envs.references.npz import read_npz, write_npz
from omni_envs.robots import G1


@pytest.fixture
def reference(smooth_qpos, smooth_object, box_scene):
    contact = np.arange(40) > 20
    return reference_from_qpos(
        G1,
        50.0,
        smooth_qpos(),
        smooth_object(),
        box_scene,
        contacts={"left_hand": contact},
        stance=np.stack([contact, ~contact], axis=1),
        provenance={"demonstration": "a test", "numbers": [1, 2.5]},
    )


@pytest.fixture
def file(reference, tmp_path):
    return reference.save(tmp_path / "reference.npz")


def assert_same(a, b):
    for f in dataclasses.fields(Reference):
        x, y = getattr(a, f.name), getattr(b, f.name)
        if isinstance(x, np.ndarray):
            np.testing.assert_array_equal(x, y)
            assert x.dtype == y.dtype
        elif f.name == "scene":
            assert x.to_dict() == y.to_dict()
        elif f.name == "contacts":
            assert x.keys() == y.keys()
            for link in x:
                np.testing.assert_array_equal(x[link], y[link])
        else:
            assert x == y, f.name


def test_round_trip(reference, file):
    assert_same(Reference.load(file), reference)


def test_round_trip_without_object(smooth_qpos, tmp_path):
    reference = reference_from_qpos(G1, 50.0, smooth_qpos())
    back = Reference.load(reference.save(tmp_path / "r.npz"))
    assert_same(back, reference)
    assert back.object_poses is None
    assert not back.stance.any()


def test_views(reference):
    assert reference.num_frames == 40
    assert reference.duration == pytest.approx(39 / 50)
    assert reference.joint_positions.shape == reference.joint_velocities.shape == (40, 29)
    index = reference.body_indices(["torso_link", "pelvis"])
    assert [reference.body_names[i] for i in index] == ["torso_link", "pelvis"]
    with pytest.raises(InvalidDataError, match="tail"):
        reference.body_indices(["tail"])


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("fps", 0.0),
        ("qpos", np.zeros((40, 30))),
        ("qvel", np.zeros((40, 36))),
        ("qvel", np.full((40, 35), np.inf)),
        ("body_positions", np.zeros((39, 30, 3))),
        ("body_quaternions", np.zeros((40, 30, 4))),
        ("body_linear_velocities", np.full((40, 30, 3), np.nan)),
        ("body_names", tuple("abc")),
        ("object_poses", None),
        ("object_velocities", None),
        ("contacts", {"tail": np.ones(40, bool)}),
        ("contacts", {"left_hand": np.ones(39, bool)}),
        ("contacts", {"left_hand": np.ones(40)}),
        ("stance", np.ones((40, 3), bool)),
    ],
)
def test_bad_fields_are_named(reference, field, value):
    with pytest.raises(InvalidDataError, match=field):
        dataclasses.replace(reference, **{field: value})


@pytest.mark.parametrize("missing", ["qpos", "robot", "fps", "body_names", "stance", "format"])
def test_a_file_without_an_array_is_refused(file, missing):
    arrays = read_npz(file)
    del arrays[missing]
    with pytest.raises(FileFormatError, match=missing):
        Reference.load(write_npz(file, arrays))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("robot", np.array("r2d2")),
        ("robot", np.array(3.0)),
        ("qpos", np.zeros((40, 30))),
        ("qvel", np.full((40, 35), np.nan)),
        ("fps", np.array([1.0, 2.0])),
        ("fps", np.array("fast")),
        ("fps", np.array(-1.0)),
        ("scene", np.array("no json")),
        ("scene", np.array("[1]")),
        ("provenance", np.array("[1")),
        ("qpos", np.array("text")),
        ("body_positions", np.zeros(3)),
        ("body_names", np.array(1.0)),
        ("object_poses", np.array(["a"] * 40)),
        ("qvel", np.array(0.0)),
        ("format", np.array("another/1")),
        ("stance", np.array(True)),
        ("contacts/tail", np.ones(40, bool)),
        ("report/nonsense", np.ones(40)),
        ("source/fps", np.array(50.0)),
    ],
)
def test_a_file_with_a_bad_array_gives_one_error(file, name, value):
    arrays = read_npz(file)
    arrays[name] = value
    with pytest.raises(FileFormatError, match=r"reference\.npz"):
        Reference.load(write_npz(file, arrays))


def test_foreign_and_broken_files_are_refused(file, tmp_path):
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    with pytest.raises(FileFormatError, match=r"reference\.npz"):
        Reference.load(file)
    np.savez(tmp_path / "foreign.npz", qpos=np.zeros((5, 36)), fps=30)
    with pytest.raises(FileFormatError, match=r"foreign\.npz"):
        Reference.load(tmp_path / "foreign.npz")
    with pytest.raises(FileFormatError, match=r"absent\.npz"):
        Reference.load(tmp_path / "absent.npz")
