import numpy as np
import pytest

from omni_envs.metrics import joints
from omni_envs.robots import G1


def test_excess_over_the_mechanical_range():
    low, high = G1.joint_ranges.T
    motion = np.tile(0.5 * (low + high), (4, 1))
    motion[1, 3], motion[2, 5], motion[3] = high[3] + 0.02, low[5] - 0.03, high
    np.testing.assert_allclose(joints.joint_violation(G1, motion), [0, 0.02, 0.03, 0], atol=1e-12)


def test_excess_over_the_speed_limits():
    motion = np.zeros((3, 29))
    motion[1:, 4] = G1.velocity_limits[4] / 50 + 0.1
    motion[2, 6] = 0.1
    speeds = joints.joint_speeds(motion, 50.0)
    np.testing.assert_allclose(speeds[:, 6], [0, 0, 5.0])
    np.testing.assert_allclose(joints.velocity_violation(G1, speeds), [0, 5.0, 0], atol=1e-9)


@pytest.mark.parametrize("fps", [30.0, 50.0])
def test_acceleration_and_jerk_of_polynomials(fps):
    t = np.arange(10) / fps
    motion = np.repeat((2.0 * t**3)[:, None], 29, axis=1)
    acceleration, jerk = joints.joint_acceleration(motion, fps), joints.joint_jerk(motion, fps)
    np.testing.assert_allclose(acceleration[1:-1], 12.0 * t[1:-1], atol=1e-8)
    np.testing.assert_allclose(jerk[2:-1], 12.0, rtol=1e-6)
    assert np.isnan(acceleration[[0, -1]]).all() and np.isnan(jerk[[0, 1, -1]]).all()


def test_root_mean_square_is_over_joints():
    motion = np.zeros((3, 29))
    motion[1, 0] = 1.0
    assert joints.joint_acceleration(motion, 1.0)[1] == pytest.approx(2.0 / np.sqrt(29))


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_motions_have_no_differences(frames):
    motion = np.zeros((frames, 29))
    assert np.isnan(joints.joint_jerk(motion, 50.0)).all()
    assert len(joints.joint_acceleration(motion, 50.0)) == frames
    assert not joints.joint_speeds(motion, 50.0).any()
