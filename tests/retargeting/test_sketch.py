"""Which frames are drawn, which count as caught, and that a caught limb gets free."""

import numpy as np
import pytest

from omni_envs.demonstrations import load_demonstration, scale_demonstration
from omni_envs.retargeting import retarget
from omni_envs.retargeting.sketch import Sketch, sketched_frames
from omni_envs.retargeting.tangents import moved
from omni_envs.robots import G1, get_robot


@pytest.fixture
def sketch():
    frames = sketched_frames(8)
    x = np.random.default_rng(0).normal(scale=0.3, size=(len(frames), G1.nv))
    qpos = moved(np.tile(G1.default_qpos, (len(frames), 1)), x)
    return Sketch(frames, qpos, np.zeros((len(frames), 2, 3, 3)), np.array([1.0, 2.0, 4.0]))


def test_first_and_last_frame_are_drawn():
    np.testing.assert_array_equal(sketched_frames(8), [0, 5, 7])
    np.testing.assert_array_equal(sketched_frames(11), [0, 5, 10])
    np.testing.assert_array_equal(sketched_frames(1), [0])


def test_frames_are_found_among_the_drawn(sketch):
    assert [sketch.drawn(t) for t in range(8)] == [0, None, None, None, None, 1, None, 2]


def test_a_frame_far_dearer_than_the_sketch_is_caught(sketch):
    assert not sketch.catches(1, 2.6) and sketch.catches(1, 2.7)
    assert not sketch.catches(2, 5.2) and sketch.catches(2, 5.3)


@pytest.mark.slow
def test_caught_limbs_get_free(shared, monkeypatch):
    """H1 climbs two stacked boxes: its long legs hang on their edges."""
    folder, robot = shared / "data/climb/seq_1", get_robot("h1")
    (path,) = folder.glob("*.npy")
    clip = load_demonstration(path, terrain_mesh=folder / "multi_boxes.obj")
    source = scale_demonstration(clip, robot.height)
    freed = retarget(source, robot).frames
    monkeypatch.setattr(Sketch, "catches", lambda *_: False)
    caught = retarget(source, robot).frames
    assert freed.energy.mean() < 0.8 * caught.energy.mean()
    assert freed.relaxed.sum() <= caught.relaxed.sum()
