import numpy as np

from omni_envs.tracking import kernels


def test_sines_are_exact_to_a_rounding():
    angles = np.random.default_rng(0).uniform(-20.0, 20.0, 10_000)
    angles[:3] = 0.0, np.pi / 4, 1e6
    sines, cosines = np.empty((2, 10_000))
    kernels.sines(angles, sines, cosines)
    np.testing.assert_allclose(sines, np.sin(angles), rtol=0, atol=2.3e-16)
    np.testing.assert_allclose(cosines, np.cos(angles), rtol=0, atol=2.3e-16)
