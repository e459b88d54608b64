import tracemalloc

import numpy as np
import pytest

from omni_envs.demonstrations import SourceOptions, bvh
from omni_envs.demonstrations.bvh import read_bvh
from omni_envs.demonstrations.bvh_source import record_bvh
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


def test_names_with_blanks_and_channels_in_lower_case(tmp_path):
    text = TEXT.replace("JOINT Knee", "JOINT Bip01 L Calf").replace("Xrotation Z", "xrotation z")
    motion = read_bvh(write(tmp_path, text))
    assert [j.name for j in motion.joints][1:3] == ["Bip01 L Calf", "Bip01 L CalfEnd"]
    expected = read_bvh(write(tmp_path, TEXT)).positions()
    np.testing.assert_array_equal(motion.positions(), expected)


def test_an_end_site_gives_way_to_a_joint_of_its_name(tmp_path):
    text = TEXT.replace("ROOT Hips", "ROOT HeadEnd")
    names = [joint.name for joint in read_bvh(write(tmp_path, text)).joints]
    assert names == ["HeadEnd", "Knee", "KneeEnd", "Head", "HeadEndSite"]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda t: t.replace("JOINT Head", "JOINT Knee"), "names that differ; found several Knee"),
        (lambda t: t.replace("CHANNELS 3", "CHANNELS 9999999"), "CHANNELS of Knee.*0 to 6"),
        (lambda t: t.replace("CHANNELS 3", "CHANNELS nan"), "CHANNELS of Knee.*0 to 6"),
        (lambda t: t.replace("OFFSET 0 -40 0", "OFFSET 0 inf 0"), "OFFSET of Knee.*finite"),
        (lambda t: t.replace("Frames: 2", "Frames: 1e30"), "Frames"),
        (lambda t: t.replace("Frames: 2", "Frames: 2.5"), "Frames"),
        (lambda t: t + "7 7\n", "30 numbers; found 32"),
        (lambda t: t.replace("MOTION", "ROOT Other\n{\nOFFSET 0 0 0\n}\nMOTION"), "one ROOT"),
        (lambda t: "\x00" * 50 + t, "HIERARCHY"),
    ],
)
def test_more_damaged_files(tmp_path, change, match):
    with pytest.raises(FileFormatError, match=match):
        read_bvh(write(tmp_path, change(TEXT)))


def test_rows_are_picked_from_a_stream(tmp_path, monkeypatch):
    """Chunks of a few bytes, so that numbers and rows straddle them."""
    head = TEXT[: TEXT.index("Frames: 2")]
    values = np.arange(50 * 15).reshape(50, 15) / 7.0
    rows = "\n".join(" ".join(f"{v:.5f}" for v in row) for row in values)
    path = write(tmp_path, f"{head}Frames: 50\nFrame Time: 0.01\n{rows}\n")
    monkeypatch.setattr(bvh, "_CHUNK_BYTES", 37)
    monkeypatch.setattr(bvh, "_HEADER_BYTES", len(head) + 60)
    np.testing.assert_allclose(read_bvh(path).values, values, atol=1e-5)
    for keep in (slice(0, 50, 3), slice(17, 31, 1), slice(11, 50, 4), slice(49, 50, 1)):
        picked = read_bvh(path, lambda frames, seconds, keep=keep: keep)
        np.testing.assert_allclose(picked.values, values[keep], atol=1e-5)
    short = write(tmp_path, path.read_text()[:-200])
    assert len(read_bvh(short, lambda frames, seconds: slice(0, 20, 1)).values) == 20
    with pytest.raises(FileFormatError, match="750 numbers; found"):
        read_bvh(short, lambda frames, seconds: slice(20, 50, 1))


def test_a_million_frames_take_bounded_memory(tmp_path):
    """The whole is refused before it is read, a part is read and the rest is not."""
    frames = 1_000_000
    head = TEXT[: TEXT.index("Frames: 2")]
    row = b"1 2 3 0 0 0  0 0 0  5 50 0 0 0 0\n"
    path = tmp_path / "long.bvh"
    with path.open("wb") as file:
        file.write(f"{head}Frames: {frames}\nFrame Time: 0.00833333\n".encode())
        for _ in range(100):
            file.write(row * (frames // 100))
    options = SourceOptions()
    with pytest.raises(FileFormatError, match=r"at most 100000 frames; cut the file with.*1000000"):
        record_bvh(path, options)
    tracemalloc.start()
    try:
        part = record_bvh(path, SourceOptions(start=100.0, end=110.0))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(part.positions) == 300 and part.fps == 30
    assert peak < 200e6  # words of 8 MB of text; the file has 33 MB
    path.unlink()
