import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, load_demonstration
from omni_envs.errors import FileFormatError, InvalidOptionError, UnknownNameError


def test_dispatches_on_the_name(tmp_path):
    assert load_demonstration("box_carry") is builtin_demonstration("box_carry")
    np.save(tmp_path / "climb.npy", np.zeros((8, 53, 3)))
    demo = load_demonstration(tmp_path / "climb.npy", height=1.6)
    assert demo.height == 1.6 and demo.num_frames == 2
    assert load_demonstration(str(tmp_path / "climb.npy")).name == "climb"


def test_unknown_name_lists_the_built_ins():
    with pytest.raises(UnknownNameError, match="Did you mean 'box_carry'"):
        load_demonstration("boxcarry")


@pytest.mark.parametrize("name", ["clip.fbx", "clip.mp4"])
def test_unknown_format(tmp_path, name):
    (tmp_path / name).write_text("?")
    with pytest.raises(FileFormatError, match=r"\.bvh, \.npy, \.npz, \.pt, \.txt, \.json"):
        load_demonstration(tmp_path / name)


@pytest.mark.parametrize("name", ["omomo.p", "smpl.pkl", "x.pickle"])
def test_pickles_are_refused_with_the_way_round(tmp_path, name):
    with pytest.raises(FileFormatError, match=r"without code.*joblib\.load\('FILE\.p'\)"):
        load_demonstration(tmp_path / name)


def test_missing_file_of_every_known_format(tmp_path):
    pytest.importorskip("torch")
    for name in ("a.pt", "a.npy", "a.npz", "a.bvh", "a.txt", "a.json"):
        with pytest.raises(FileFormatError, match="existing"):
            load_demonstration(tmp_path / name)
        (tmp_path / name).mkdir()
        with pytest.raises(FileFormatError, match="existing"):
            load_demonstration(tmp_path / name)


@pytest.mark.parametrize("name", ["a.npy", "a.npz", "a.bvh", "a.txt", "a.json", "a.pt"])
@pytest.mark.parametrize("content", [b"", b"\x80\x04K\x01.", b"PK\x03\x04", b"\x00" * 999])
def test_empty_files_and_other_data(tmp_path, name, content):
    if name.endswith("pt"):
        pytest.importorskip("torch")
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(FileFormatError) as error:
        load_demonstration(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_robot_motions_are_sent_elsewhere(tmp_path):
    np.savez(tmp_path / "robot.npz", fps=50.0, qpos=np.zeros((3, 36)))
    with pytest.raises(FileFormatError, match=r"a robot's motion \(omni-envs evaluate"):
        load_demonstration(tmp_path / "robot.npz")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(FileFormatError, match=r"arrays: expected positions.*found a"):
        load_demonstration(tmp_path / "other.npz")


@pytest.mark.parametrize("height", [0.0, -1.7, np.nan, 170.0])
def test_height_must_be_a_height(height):
    with pytest.raises(InvalidOptionError, match="height"):
        load_demonstration("box_carry", height=height)


def test_options_that_do_not_apply_are_refused(tmp_path, person, write_bvh):
    np.save(tmp_path / "a.npy", np.zeros((8, 53, 3)))
    np.savez(tmp_path / "smpl.npz", poses=np.zeros((3, 156)), trans=np.zeros((3, 3)))
    np.savez(tmp_path / "omomo.npz", obj_trans=np.zeros((3, 3)))
    for source, option in (
        ("box_carry", {"object_mesh": "x.obj"}),
        ("box_carry", {"start": 1.0}),
        (tmp_path / "a.pt", {"terrain_mesh": "x.obj"}),
        (tmp_path / "a.pt", {"unit": "cm"}),
        (tmp_path / "a.npy", {"object_mesh": "x.obj"}),
        (tmp_path / "a.npy", {"body_model": "x.npz"}),
        (tmp_path / "smpl.npz", {"unit": "cm"}),
        (tmp_path / "omomo.npz", {"up": "z"}),
        (write_bvh(person()), {"object_mesh": "x.obj"}),
        (tmp_path / "a.txt", {"skeleton": "smpl"}),
    ):
        (name,) = option
        with pytest.raises(InvalidOptionError, match=f"{name} does not apply to"):
            load_demonstration(source, **option)
