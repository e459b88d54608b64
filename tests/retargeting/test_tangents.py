import numpy as np

from omni_envs.retargeting.tangents import difference, motion_steps, moved
from omni_envs.robots import G1


def wandering(frames):
    rng = np.random.default_rng(0)
    q = np.tile(G1.default_qpos, (frames, 1))
    return moved(q, rng.normal(scale=0.5, size=(frames, G1.nv)))


def test_difference_is_the_way_there():
    a, b = wandering(6)[:3], wandering(6)[3:]
    there = moved(a, difference(a, b))
    flip = np.sign(np.sum(there[:, 3:7] * b[:, 3:7], axis=1))[:, None]
    np.testing.assert_allclose(there[:, 3:7], flip * b[:, 3:7], atol=1e-12)
    np.testing.assert_allclose(np.delete(there, np.s_[3:7], 1), np.delete(b, np.s_[3:7], 1))


def test_steps_are_differences_of_successive_frames():
    qpos = wandering(4)
    np.testing.assert_array_equal(motion_steps(qpos), difference(qpos[:-1], qpos[1:]))
