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
