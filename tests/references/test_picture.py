from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, scale_demonstration
from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.metrics import evaluate
from omni_envs.references import reference_from_qpos, report_picture
from omni_envs.robots import G1

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def reference():
    source = scale_demonstration(builtin_demonstration("box_carry"), G1.height)
    qpos = np.tile(G1.default_qpos, (source.num_frames, 1))
    qpos[:, :2] = source.keypoints[:, 0, :2]
    args = (G1, source.scene, 30.0, qpos, source.object_poses, source)
    report = evaluate(*args, relaxed=np.arange(source.num_frames) % 50 == 0)
    return reference_from_qpos(G1, 30.0, qpos, source.object_poses, source.scene, report=report)


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_one_page(reference, tmp_path, suffix):
    path = report_picture(reference, tmp_path / "new" / f"report{suffix}")
    assert path.stat().st_size > 10_000


def test_the_picture_is_not_blank(reference, tmp_path):
    from matplotlib.image import imread

    picture = imread(report_picture(reference, tmp_path / "report.png"))
    height, width = picture.shape[:2]
    assert 1.3 < height / width < 1.5  # A4
    # Every sixth of the page has something drawn in it.
    for band in np.array_split(picture[..., :3].min(axis=2), 6):
        assert (band < 0.9).mean() > 0.01


def test_without_a_source(smooth_qpos, tmp_path):
    from omni_envs.scenes import Scene

    qpos = smooth_qpos()
    report = evaluate(G1, Scene(), 50.0, qpos)
    reference = reference_from_qpos(G1, 50.0, qpos, report=report)
    assert report_picture(reference, tmp_path / "report.png").exists()


def test_bad_arguments(reference, tmp_path):
    with pytest.raises(InvalidOptionError, match=r"\.bmp"):
        report_picture(reference, tmp_path / "report.bmp")
    with pytest.raises(InvalidDataError, match="report"):
        report_picture(replace(reference, report=None), tmp_path / "report.png")
