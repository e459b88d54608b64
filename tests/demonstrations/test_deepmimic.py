import json

import numpy as np
import pytest

from omni_envs.demonstrations import deepmimic, load_demonstration, scale_demonstration
from omni_envs.errors import FileFormatError


def frames(count=5, seconds=1 / 30):
    row = [seconds, 0.0, 0.88, 0.0, 1, 0, 0, 0]
    quaternion, legs = [1, 0, 0, 0], []
    for _ in ("right", "left"):
        legs += [*quaternion, 0.0, *quaternion, *quaternion, 0.0]
    return [[*row, *quaternion, *quaternion, *legs][:] for _ in range(count)]


def write(folder, content, name="clip.txt"):
    path = folder / name
    path.write_text(content if isinstance(content, str) else json.dumps({"Frames": content}))
    return path


def joint(demo, name):
    return demo.positions[:, demo.joint_names.index(name)]


def test_the_humanoid_stands_and_bends_the_right_way(tmp_path):
    data = frames()
    assert len(data[0]) == 44
    for row in data:
        row[20] = -0.5 * np.pi  # right knee: the shin points backwards
        row[29] = 0.5 * np.pi  # right elbow: the forearm points forwards
    demo = load_demonstration(write(tmp_path, data, "clip.json"))
    assert demo.fps == 30 and demo.height == 1.62 and demo.num_frames == 5
    left, right = joint(demo, "left_hip")[0], joint(demo, "right_hip")[0]
    np.testing.assert_allclose(left - right, [0.0, 2 * 0.084887, 0.0], atol=1e-9)  # x forward
    shin = joint(demo, "right_ankle")[0] - joint(demo, "right_knee")[0]
    np.testing.assert_allclose(shin, [-0.40987, 0.0, 0.0], atol=1e-9)
    forearm = joint(demo, "right_hand")[0] - joint(demo, "right_elbow")[0]
    np.testing.assert_allclose(forearm, [0.258947, 0.0, 0.0], atol=1e-9)
    assert joint(demo, "left_toe")[0, 2] == 0.0
    np.testing.assert_allclose(joint(demo, "pelvis")[0, 2], 0.421546 + 0.40987 + 0.05)


@pytest.mark.parametrize(("clip", "count"), [("walk", 39), ("crawl", 89)])
def test_recorded_clips(shared, clip, count):
    demo = load_demonstration(shared / f"data/deepmimic/humanoid3d_{clip}.txt")
    assert demo.num_frames == count
    source = scale_demonstration(demo, 1.32)
    pelvis = source.keypoints[:, 0]
    if clip == "walk":
        assert pelvis[:, 2].min() > 0.6 and source.stance["code"].any()
        assert pelvis[-1, 0] - pelvis[0, 0] > 0.5  # x is forward
    else:
        assert pelvis[:, 2].max() < 0.6
        assert source.contacts["right_knee"].any()


def damaged(change):
    data = frames()
    change(data)
    return data


@pytest.mark.parametrize(
    ("content", "match"),
    [
        ("", "content: expected JSON"),
        ('{"Frames": [[0.03, 1', "content: expected JSON"),
        ("[" * 100_000, "content: expected JSON"),
        ('{"Loop": "wrap"}', "Frames: expected a list of frames"),
        ("[1, 2]", "Frames: expected a list"),
        ([], "Frames: expected a list"),
        ([[1, 2]], r"Frames: expected rows of 44 numbers; found \(1, 2\)"),
        ([[0.03] * 44, [0.03] * 43], "Frames: expected rows of 44 numbers"),
        ([["x"] * 44], "Frames: expected rows of 44 numbers"),
        (damaged(lambda d: d[3].__setitem__(7, float("nan"))), "finite values.*frame 3"),
        (damaged(lambda d: d[2].__setitem__(0, float("nan"))), "duration.*finite sec.*in frame 2"),
        (damaged(lambda d: d[3].__setitem__(4, 3.0)), "rotation of root.*length 3 in frame 3"),
        (frames(seconds=0.0), "duration of a frame.*found 0 frames"),
        (frames(seconds=33.3), "duration of a frame.*found 0.03"),
    ],
)
def test_bad_files(tmp_path, content, match):
    path = write(tmp_path, content)
    with pytest.raises(FileFormatError, match=match) as error:
        load_demonstration(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_files_that_are_too_large_are_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(deepmimic, "MAX_BYTES", 100)
    with pytest.raises(FileFormatError, match="file: expected at most"):
        load_demonstration(write(tmp_path, frames()))
