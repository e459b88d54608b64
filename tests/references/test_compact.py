"""What a reference file leaves out comes back; what does not follow stays in it."""

import dataclasses

import numpy as np
import pytest

from omni_envs.errors import FileFormatError
from omni_envs.references import Reference, evaluate_reference, reference_from_qpos
from omni_envs.references.archive import FORMAT, READABLE
from omni_envs.references.compact import BODY_ARRAYS, VELOCITY
from omni_envs.references.npz import read_npz, write_npz
from omni_envs.robots import G1, register_robot, registry


@pytest.fixture
def reference(smooth_qpos, smooth_object, box_scene):
    made = reference_from_qpos(G1, 50.0, smooth_qpos(), smooth_object(), box_scene)
    return dataclasses.replace(made, report=evaluate_reference(made))


def version_1(reference, path):
    """A file as version 1 of the format had it: with every array."""
    names = [f.name for f in dataclasses.fields(reference)]
    plain = [n for n in names if n not in ("scene", "contacts", "report", "source", "provenance")]
    arrays = read_npz(reference.save(path))
    arrays |= {name: np.asarray(getattr(reference, name)) for name in plain}
    arrays |= {f"report/{k}": v for k, v in reference.report.to_arrays().items()}
    return write_npz(path, {**arrays, "format": np.array("omni_envs.reference/1")})


def test_velocities_and_bodies_are_not_in_the_file_and_come_back_bit_by_bit(reference, tmp_path):
    path = reference.save(tmp_path / "r.npz")
    assert not {VELOCITY, *BODY_ARRAYS} & set(read_npz(path))
    back = Reference.load(path)
    for name in ("qpos", "qvel", "object_poses", "object_velocities", *BODY_ARRAYS):
        found, expected = getattr(back, name), getattr(reference, name)
        np.testing.assert_array_equal(found, expected)
        assert found.dtype == expected.dtype == np.float64


def test_a_file_saved_again_is_the_same_file(reference, tmp_path):
    first = reference.save(tmp_path / "a.npz")
    again = Reference.load(first).save(tmp_path / "b.npz")
    assert first.read_bytes() == again.read_bytes()


def test_what_does_not_follow_stays_in_the_file(reference, tmp_path):
    quaternions = -reference.body_quaternions  # the same rotations, but not the same numbers
    faster = np.nextafter(reference.qvel, np.inf)
    other = dataclasses.replace(reference, body_quaternions=quaternions, qvel=faster)
    back = Reference.load(other.save(tmp_path / "r.npz"))
    np.testing.assert_array_equal(back.body_quaternions, quaternions)
    np.testing.assert_array_equal(back.body_positions, reference.body_positions)
    np.testing.assert_array_equal(back.qvel, faster)


@pytest.mark.parametrize("scale", [0.0, 0.5])
def test_bodies_follow_from_the_velocities_of_the_file(reference, tmp_path, scale):
    qvel = scale * reference.qvel
    slow = dataclasses.replace(
        reference,
        qvel=qvel,
        body_linear_velocities=scale * reference.body_linear_velocities,
        body_angular_velocities=scale * reference.body_angular_velocities,
    )
    path = slow.save(tmp_path / "r.npz")
    assert not set(BODY_ARRAYS) & set(read_npz(path))
    back = Reference.load(path)
    np.testing.assert_array_equal(back.qvel, qvel)
    np.testing.assert_allclose(
        back.body_angular_velocities, slow.body_angular_velocities, atol=1e-12
    )


def test_files_of_version_1_are_read(reference, tmp_path):
    path = version_1(reference, tmp_path / "old.npz")
    assert set(BODY_ARRAYS) < set(read_npz(path))
    old, new = Reference.load(path), Reference.load(reference.save(tmp_path / "new.npz"))
    for name in ("qpos", "qvel", *BODY_ARRAYS):
        np.testing.assert_array_equal(getattr(old, name), getattr(new, name))
    assert old.report.summary() == reference.report.summary()
    assert path.stat().st_size > 4 * (tmp_path / "new.npz").stat().st_size


@pytest.mark.parametrize("version", ["omni_envs.reference/3", "omni_envs.reference/", "mine/1", ""])
def test_other_versions_are_refused_with_the_ones_that_can_be_read(reference, tmp_path, version):
    arrays = read_npz(reference.save(tmp_path / "r.npz")) | {"format": np.array(version)}
    with pytest.raises(FileFormatError) as caught:
        Reference.load(write_npz(tmp_path / "r.npz", arrays))
    message = str(caught.value)
    assert all(readable in message for readable in (*READABLE, f"{version!r}", "r.npz"))
    assert ("another version of omni_envs" in message) == version.startswith("omni_envs.")
    assert READABLE[-1] == FORMAT


def test_a_robot_that_is_not_registered_keeps_its_bodies(smooth_qpos, tmp_path, monkeypatch):
    mine = dataclasses.replace(G1, name="mine")
    reference = reference_from_qpos(mine, 50.0, smooth_qpos())
    path = reference.save(tmp_path / "r.npz")
    assert set(BODY_ARRAYS) < set(read_npz(path))
    with pytest.raises(FileFormatError, match=r"robot.*g1.*'mine'"):
        Reference.load(path)
    monkeypatch.setattr(registry, "_ROBOTS", dict(registry._ROBOTS))
    register_robot(mine)
    saved = Reference.load(path).save(tmp_path / "registered.npz")
    assert not set(BODY_ARRAYS) & set(read_npz(saved))
    np.testing.assert_array_equal(Reference.load(saved).body_positions, reference.body_positions)
