import numpy as np
import pytest

from omni_envs.demonstrations import SourceOptions, inspect_recording
from omni_envs.errors import FileFormatError


def test_a_known_naming(person, write_bvh):
    seen = inspect_recording(write_bvh(person(fps=60.0), bones_along_x=True))
    assert seen.known == "lafan1" and seen.frames == 61 and seen.problem is None
    assert seen.conventions.up == "y" and seen.conventions.unit == "cm"
    assert seen.conventions.fps == 30 and seen.conventions.height == pytest.approx(1.731, abs=1e-3)
    assert "Spine1" in seen.guess.unused and not seen.guess.doubtful


def test_an_unknown_one_is_proposed(person, write_bvh):
    path = write_bvh(person(), rename=lambda n: n.replace("ForeArm", "Elbow"))
    seen = inspect_recording(path)
    assert seen.known is None and seen.guess.skeleton.keypoints["left_elbow"] == "LeftElbow"
    seen = inspect_recording(path, SourceOptions(height=1.8))
    assert seen.conventions.height == 1.8


def test_what_is_missing_is_told(person, write_bvh, tmp_path):
    seen = inspect_recording(write_bvh(person(), unit=0.1))
    assert seen.conventions is None and "unit of length" in seen.problem
    np.save(tmp_path / "a.npy", person().pose()[0])
    assert inspect_recording(tmp_path / "a.npy", SourceOptions(fps=30.0)).known == "lafan1"
    with pytest.raises(FileFormatError, match="one skeleton each"):
        inspect_recording(tmp_path / "a.pt")
    with pytest.raises(FileFormatError, match="existing"):
        inspect_recording(tmp_path / "a.bvh")
