import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, builtin_names
from omni_envs.demonstrations.jumps import find_jumps


@pytest.mark.parametrize("name", builtin_names())
def test_smooth_motion_has_none(name):
    demonstration = builtin_demonstration(name)
    assert not len(find_jumps(demonstration.keypoints, demonstration.fps))


@pytest.mark.parametrize("scale", [1.0, 0.7])
def test_swaps_and_glitches_are_found(scale):
    demonstration = builtin_demonstration("box_carry")
    points = scale * demonstration.keypoints.copy()
    points[100:103, [11, 14]] = points[100:103, [14, 11]]  # the hands, 0.4 m apart
    points[200] += scale * np.array([1.0, 0.0, 0.0])
    found = find_jumps(points, demonstration.fps, scale)
    assert set(found[:, 0]) == {100, 103, 200, 201}
    assert set(found[found[:, 0] == 100, 1]) == {11, 14}
    assert (found[:, 0] == 200).sum() == 15


def test_a_fast_kick_is_no_jump():
    t = np.arange(60) / 30.0
    foot = 1.0 / (1.0 + np.exp(-20.0 * (t - 1.0)))  # 2.5 m in a fifth of a second: 12 m/s
    points = np.zeros((60, 1, 3))
    points[:, 0, 0] = 2.5 * foot
    assert np.abs(np.diff(points[:, 0, 0])).max() * 30 > 10
    assert not len(find_jumps(points, 30.0))
