import numpy as np
import pytest

from omni_envs.demonstrations.bvh import read_bvh
from omni_envs.errors import FileFormatError

TEXT = """HIERARCHY
ROOT Hips
{
  OFFSET 100 200 300
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0 -40 0
    CHANNELS 3 Xrotation Zrotation Yrotation
    End Site
    {
      OFFSET 0 -30 0
    }
  }
  JOINT Head
  {
    OFFSET 0 50 0
    CHANNELS 6 Zposition Yposition Xposition Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 10 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
1 2 3 0 0 0  0 0 0  5 50 0 0 0 0
1 2 3 90 0 0  90 90 0  0 50 0 0 0 90
"""


def write(folder, text, name="clip.bvh"):
    (folder / name).write_text(text)
    return folder / name


def test_positions_by_hand(tmp_path):
    motion = read_bvh(write(tmp_path, TEXT))
    names = [joint.name for joint in motion.joints]
    assert names == ["Hips", "Knee", "KneeEnd", "Head", "HeadEnd"]
    assert motion.frame_time == 0.02
    hips, knee, knee_end, head, head_end = np.moveaxis(motion.positions(), 1, 0)
    np.testing.assert_allclose(hips, [[1, 2, 3]] * 2)  # the root's OFFSET is not added
    np.testing.assert_allclose(knee[0], [1, -38, 3])
    np.testing.assert_allclose(knee_end[0], [1, -68, 3])
    # Position channels replace the OFFSET, in their declared order.
    np.testing.assert_allclose(head[0], [1, 52, 8])
    np.testing.assert_allclose(head_end[0], [1, 62, 8])
    # Frame 1: the root turns by 90° about z, so −y becomes +x.
    np.testing.assert_allclose(knee[1], [41, 2, 3], atol=1e-12)
    # Knee: X by 90° first in the chain, then Z: R = Rx Rz takes −y to +x, and the root that to +y.
    np.testing.assert_allclose(knee_end[1], [41, 32, 3], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda t: "", "HIERARCHY"),
        (lambda t: "hello world", "HIERARCHY"),
        (lambda t: t.replace("MOTION", ""), "MOTION"),
        (lambda t: t[: t.index("Frame Time")], "MOTION"),
        (lambda t: t.rstrip()[:-3], r"30 numbers; found 29"),
        (lambda t: t.replace("Frames: 2", "Frames: 0"), "at least 1"),
        (lambda t: t.replace("0.02", "0"), "Frame Time"),
        (lambda t: t.replace("0.02", "fast"), "a number"),
        (lambda t: t.replace("1 2 3 90", "1 2 nan 90"), "frame 1"),
        (lambda t: t.replace("1 2 3 90", "1 2 x 90"), "numbers"),
        (lambda t: t.replace("Xrotation Zrotation", "Wrotation Zrotation"), "Wrotation"),
        (lambda t: t.replace("OFFSET 0 -40 0", "OFFSET 0 -40"), "OFFSET of Knee"),
        (lambda t: t.replace("OFFSET 0 50 0", "SCALE 2"), "SCALE"),
        (lambda t: t.replace("}\nMOTION", "MOTION"), "early end"),
        (lambda t: t.replace("}\nMOTION", "}\n}\nMOTION"), "early end"),
    ],
)
def test_damaged_files(tmp_path, change, match):
    with pytest.raises(FileFormatError, match=match) as error:
        read_bvh(write(tmp_path, change(TEXT)))
    assert "clip.bvh" in str(error.value)


def test_missing(tmp_path):
    with pytest.raises(FileFormatError, match="existing"):
        read_bvh(tmp_path / "clip.bvh")
