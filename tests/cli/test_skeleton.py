"""``omni-envs skeleton``, and the flags that tell how to read a recording."""

import json

import numpy as np
import pytest
import yaml

from omni_envs.cli import main
from omni_envs.demonstrations import load_demonstration, read_skeleton_map
from omni_envs.robots import KEYPOINTS

# A person who stands still: joint, parent, place (m; x left, y up, z forward).
PLACES = {
    "pelvis": (0, 0.93, 0), "neckBase": (0, 1.4, 0),
    **{
        f"{part}{side}": (sign * x, y, z)
        for side, sign in (("_l", 1), ("_r", -1))
        for part, x, y, z in (
            ("thigh", 0.1, 0.91, 0), ("calf", 0.1, 0.48, 0), ("foot", 0.1, 0.06, 0),
            ("ball", 0.1, 0.0, 0.14), ("clavicle", 0.05, 1.42, 0), ("upperarm", 0.17, 1.42, 0),
            ("lowerarm", 0.46, 1.42, 0), ("hand", 0.71, 1.42, 0),
        )
    },
}  # fmt: skip


@pytest.fixture
def recording(tmp_path):
    """Joint positions under a naming that nobody knows, in centimetres, y up, 60 fps."""
    positions = np.tile(100.0 * np.array(list(PLACES.values())), (31, 1, 1))
    path = tmp_path / "still.npz"
    np.savez(path, positions=positions, fps=60.0, joint_names=np.array(list(PLACES)))
    return path


def test_a_proposal_becomes_a_map(recording, tmp_path, capsys):
    assert main(["skeleton", str(recording), "--out", str(tmp_path / "map.yaml")]) == 0
    printed = capsys.readouterr().out
    assert "no known naming: a proposal, check it" in printed
    assert "y up, cm, a person of 1.73 m" in printed and "16 frames at 30 fps" in printed
    assert "15 of 15 keypoints" in printed and "clavicle_l" in printed
    told = read_skeleton_map(tmp_path / "map.yaml")
    assert yaml.safe_load(printed) == yaml.safe_load(told.to_yaml())
    assert set(told.keypoints) == set(KEYPOINTS) and told.keypoints["left_toe"] == "ball_l"
    demo = load_demonstration(recording, skeleton=tmp_path / "map.yaml")
    assert demo.keypoint_joints["right_shoulder"] == "upperarm_r"


def test_json(recording, capsys):
    assert main(["skeleton", str(recording), "--json", "--height", "1.8", "--end", "0.2"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert rows["known"] is None and rows["problem"] is None and rows["doubtful"] == []
    assert rows["conventions"] == {"up": "y", "unit": "cm", "fps": 30.0, "height": 1.8}
    assert rows["frames"] == 6 and rows["scores"]["left_knee"] == 1.0


def test_what_cannot_be_found_is_said(recording, capsys):
    arrays = dict(np.load(recording))
    np.savez(recording, **(arrays | {"positions": 0.1 * arrays["positions"]}))
    assert main(["skeleton", str(recording), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert rows["conventions"] is None and "unit of length" in rows["problem"]
    assert main(["skeleton", str(recording.with_name("x.pt"))]) == 1
    assert "one skeleton each" in capsys.readouterr().err


def test_retarget_without_a_map_points_here(recording, tmp_path, capsys):
    out = tmp_path / "reference.npz"
    assert main(["retarget", str(recording), "--out", str(out)]) == 1
    message = capsys.readouterr().err
    assert "omni-envs skeleton still.npz" in message and len(message.splitlines()) == 1


def test_retarget_takes_the_flags_of_the_source(recording, tmp_path, capsys):
    skeleton, out = tmp_path / "map.yaml", tmp_path / "reference.npz"
    assert main(["skeleton", str(recording), "--out", str(skeleton), "--json"]) == 0
    capsys.readouterr()
    arguments = ["--skeleton", str(skeleton), "--fps-source", "30", "--start", "0.5", "--up", "y"]
    arguments += ["--unit", "cm", "--height", "1.7", "--fps", "30", "--no-refine", "--json"]
    assert main(["retarget", str(recording), "--out", str(out), *arguments]) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == 16  # 31 frames at 30 fps, the last 16
    assert main(["retarget", str(recording), "--out", str(out), "--start", "9"]) == 1
    assert "start, end" in capsys.readouterr().err
