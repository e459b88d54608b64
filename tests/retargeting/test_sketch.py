"""The sketch: interpolation, when a frame counts as caught, and that a caught limb gets free."""

import numpy as np
import pytest

from omni_envs.demonstrations import load_demonstration, scale_demonstration
from omni_envs.retargeting import retarget
from omni_envs.retargeting.sketch import Sketch, sketched_frames
from omni_envs.retargeting.tangents import difference, moved
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


def test_poses_between_are_on_the_way(sketch):
    for k, t in enumerate(sketch.frames):
        np.testing.assert_allclose(np.abs(sketch.pose(t)), np.abs(sketch.qpos[k]), atol=1e-12)
    way = difference(sketch.qpos[:1], sketch.qpos[1:2])
    np.testing.assert_allclose(sketch.pose(2), moved(sketch.qpos[:1], 0.4 * way)[0], atol=1e-12)
    single = Sketch(np.array([0]), sketch.qpos[:1], sketch.feet[:1], sketch.costs[:1])
    np.testing.assert_array_equal(single.pose(0), sketch.qpos[0])


def test_a_frame_far_dearer_than_the_sketch_is_caught(sketch):
    assert not sketch.catches(5, 2.6) and sketch.catches(5, 2.7)
    assert not sketch.catches(6, 3.9) and sketch.catches(6, 4.0)


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
