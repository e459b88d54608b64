from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, scale_demonstration
from omni_envs.errors import InvalidDataError
from omni_envs.references import ForeignMotion, reference_from_motion
from omni_envs.robots import G1


@pytest.fixture(scope="module")
def demonstration():
    return builtin_demonstration("box_carry")


def make_motion(demonstration, frames, fps):
    """A stiff robot carried along with the pelvis of the demonstration."""
    source = scale_demonstration(demonstration, G1.height)
    step = 30.0 / fps
    at = np.minimum((np.arange(frames) * step).astype(int), source.num_frames - 1)
    qpos = np.tile(G1.default_qpos, (frames, 1))
    qpos[:, :2] = source.keypoints[at, 0, :2]
    poses = source.object_poses[at]
    return ForeignMotion(Path("m.npz"), "holosoma_retargeter", G1, fps, qpos, poses)


@pytest.mark.parametrize(("fps", "missing"), [(30.0, 0), (50.0, 0), (50.0, 1)])
def test_motion_and_demonstration_become_a_reference(demonstration, fps, missing):
    frames = int((demonstration.num_frames - 1) * fps / 30.0) + 1 - missing
    reference = reference_from_motion(make_motion(demonstration, frames, fps), demonstration)
    assert (reference.num_frames, reference.fps) == (frames, fps)
    assert reference.source.num_frames == frames
    assert reference.scene.object is not None
    assert reference.stance.any()
    assert reference.report.summary()["energy_mean"] > 0
    assert reference.provenance["format"] == "holosoma_retargeter"


def test_other_lengths_are_refused(demonstration):
    with pytest.raises(InvalidDataError, match="length"):
        reference_from_motion(make_motion(demonstration, 100, 30.0), demonstration)


def test_without_a_demonstration(demonstration):
    motion = make_motion(demonstration, 20, 30.0)
    with pytest.raises(InvalidDataError, match="demonstration"):
        reference_from_motion(motion)
    alone = ForeignMotion(motion.path, motion.format, G1, 30.0, motion.qpos)
    reference = reference_from_motion(alone)
    assert reference.source is None
    assert reference.report.summary()["energy_mean"] is None
