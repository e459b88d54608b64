import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.errors import InvalidDataError
from omni_envs.resampling import frame_grid, resample_poses


def _smooth_poses(frames=40, fps=50.0):
    t = np.arange(frames)[:, None] / fps
    turn = rotations.exp(np.concatenate([0.4 * np.sin(3 * t), 0.3 * t, 1.5 * t], axis=1))
    position = np.concatenate([0.8 * t, 0.3 * np.sin(2 * t), 0.1 * np.cos(3 * t)], axis=1)
    return np.concatenate([position, turn, 0.3 * np.sin(2 * t + np.arange(29))], axis=1)


@pytest.fixture
def smooth_poses():
    return _smooth_poses


def test_new_frames_lie_on_the_old_motion(smooth_poses):
    slow, fast = smooth_poses(31, 30.0), smooth_poses(51, 50.0)
    out = resample_poses(slow, 30.0, 50.0)
    assert out.shape == fast.shape
    np.testing.assert_allclose(out[:, :3], fast[:, :3], atol=5e-3)
    np.testing.assert_allclose(out[:, 7:], fast[:, 7:], atol=5e-3)
    angle = np.linalg.norm(rotations.difference(out[:, 3:7], fast[:, 3:7]), axis=1)
    assert angle.max() < 5e-3


def test_the_last_frame_stays_when_it_is_on_the_grid(smooth_poses):
    poses = smooth_poses(31, 30.0)
    np.testing.assert_allclose(resample_poses(poses, 30.0, 50.0)[-1], poses[-1], atol=1e-12)


def test_the_result_never_reaches_beyond_the_motion(smooth_poses):
    out = resample_poses(smooth_poses(30, 30.0), 30.0, 50.0)
    assert len(out) == 49  # 29/30 s = 48.3 new frames


@pytest.mark.parametrize("frames", [1, 2, 7, 1000])
@pytest.mark.parametrize("fps", [30.0, 29.97, 50.0, 120.0, 1 / 0.00833])
def test_the_same_rate_changes_nothing(frames, fps):
    left, weight = frame_grid(frames, fps, fps)
    assert (left == np.arange(frames)).all()
    assert not weight.any()


def test_quaternions_turn_evenly_on_the_short_arc():
    poses = np.zeros((2, 7))
    poses[0, 3:] = rotations.exp(np.array([0.0, 0.0, 0.5]))
    poses[1, 3:] = -rotations.exp(np.array([0.0, 0.0, 1.5]))
    out = resample_poses(poses, 1.0, 4.0)
    np.testing.assert_allclose(
        rotations.log(out[:, 3:])[:, 2], [0.5, 0.75, 1.0, 1.25, 1.5], atol=1e-12
    )


@pytest.mark.parametrize(("fps", "new"), [(0.0, 50.0), (30.0, -1.0), (np.nan, 50.0)])
def test_bad_rates_are_refused(fps, new, smooth_poses):
    with pytest.raises(InvalidDataError, match="fps must be positive"):
        resample_poses(smooth_poses(), fps, new)


@pytest.mark.parametrize("shape", [(0, 7), (5, 6), (7,)])
def test_bad_shapes_are_refused(shape):
    with pytest.raises(InvalidDataError, match="shape"):
        resample_poses(np.zeros(shape), 30.0, 50.0)
