import numpy as np

from omni_envs.retargeting.ramps import ramps


def test_pulls_start_gently():
    flags = np.zeros((3, 25), bool)
    flags[0, 10:15] = True
    flags[1] = True
    weights, nearest = ramps(flags, 40.0)
    np.testing.assert_allclose(weights[0, 5:12], [0, 0.2, 0.4, 0.6, 0.8, 1, 1])
    np.testing.assert_allclose(weights[0, 13:20], [1, 1, 0.8, 0.6, 0.4, 0.2, 0])
    # Before a contact the place is the first one touched, after it the last.
    assert nearest[0, 7] == 10 and nearest[0, 12] == 12 and nearest[0, 17] == 14
    assert (weights[1] == 1.0).all() and (weights[2] == 0.0).all()
