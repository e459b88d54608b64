import numpy as np

from omni_envs.demonstrations.resampling import resample_positions


def path(frames, fps):
    t = np.arange(frames) / fps
    return np.stack([t, 2 * t, 1 - t], axis=-1)[:, None]


def test_whole_ratio_takes_recorded_frames():
    positions = np.random.default_rng(0).normal(size=(13, 2, 3))
    np.testing.assert_array_equal(resample_positions(positions, 120), positions[::4])
    np.testing.assert_array_equal(resample_positions(positions, 30), positions)


def test_any_ratio_keeps_time():
    resampled = resample_positions(path(101, 100.0), 100.0, 30.0)
    np.testing.assert_allclose(resampled, path(31, 30.0), atol=1e-12)
    slow = resample_positions(path(11, 20.0), 20.0, 30.0)
    np.testing.assert_allclose(slow, path(16, 30.0), atol=1e-12)


def test_one_frame():
    one = np.ones((1, 4, 3))
    np.testing.assert_array_equal(resample_positions(one, 24.0), one)
