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
    with pytest.raises(FileFormatError, match=r"\.bvh, \.npy, \.pt"):
        load_demonstration(tmp_path / name)


def test_missing_file_of_a_known_format(tmp_path):
    pytest.importorskip("torch")
    for name in ("a.pt", "a.npy", "a.bvh"):
        with pytest.raises(FileFormatError, match="existing"):
            load_demonstration(tmp_path / name)


@pytest.mark.parametrize("height", [0.0, -1.7, np.nan, 170.0])
def test_height_must_be_a_height(height):
    with pytest.raises(InvalidOptionError, match="height"):
        load_demonstration("box_carry", height=height)


def test_options_that_do_not_apply_are_refused(tmp_path):
    with pytest.raises(InvalidOptionError, match="object_mesh does not apply"):
        load_demonstration("box_carry", object_mesh="x.obj")
    with pytest.raises(InvalidOptionError, match="terrain_mesh does not apply"):
        load_demonstration(tmp_path / "a.pt", terrain_mesh="x.obj")
    with pytest.raises(InvalidOptionError, match="object_mesh does not apply"):
        load_demonstration(tmp_path / "a.npy", object_mesh="x.obj")
