import numpy as np
import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.viewer.pictures import picture_strip, write_picture, write_video

imageio = pytest.importorskip("imageio.v2")
PICTURES = [np.full((32, 48, 3), value, np.uint8) for value in (10, 120, 230)]


def test_strip_fills_rows_and_whitens_the_rest():
    strip = picture_strip(PICTURES, columns=2)
    assert strip.shape == (64, 96, 3)
    assert strip[0, 0, 0] == 10 and strip[0, 95, 0] == 120
    assert strip[63, 0, 0] == 230 and strip[63, 95, 0] == 255


def test_picture_round_trip(tmp_path):
    path = write_picture(tmp_path / "new" / "a.png", PICTURES[1])
    np.testing.assert_array_equal(imageio.imread(path), PICTURES[1])


def test_fewer_colours_make_a_smaller_file_of_nearly_the_same_picture(tmp_path):
    x, y = np.meshgrid(np.linspace(0, 1, 120), np.linspace(0, 1, 80))
    smooth = 250 * np.stack([x, y, 0.5 + 0.4 * np.sin(9 * x * y)], axis=-1)
    picture = (smooth + np.random.default_rng(0).integers(0, 4, smooth.shape)).astype(np.uint8)
    whole = write_picture(tmp_path / "whole.png", picture)
    small = write_picture(tmp_path / "small.png", picture, colours=256)
    assert small.stat().st_size < 0.6 * whole.stat().st_size
    found = imageio.imread(small)[..., :3].astype(float)
    assert len(np.unique(found.reshape(-1, 3), axis=0)) <= 256
    assert np.abs(found - picture).mean() < 8


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_video_has_every_picture(tmp_path, suffix):
    path = write_video(tmp_path / f"a{suffix}", iter(PICTURES), fps=25)
    frames = imageio.mimread(path)
    assert len(frames) == 3
    assert [int(np.mean(f[..., :3])) for f in frames] == pytest.approx([10, 120, 230], abs=6)


def test_unknown_suffix_names_the_valid_ones(tmp_path):
    with pytest.raises(InvalidOptionError, match=r"\.mp4, \.gif"):
        write_video(tmp_path / "a.avi", PICTURES, 25)
    with pytest.raises(InvalidOptionError, match=r"\.png"):
        write_picture(tmp_path / "a.bmp", PICTURES[0])
