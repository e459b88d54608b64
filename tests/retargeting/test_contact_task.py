import numpy as np
import pytest

from omni_envs.retargeting.contact_task import _FADES, _FULL, pull

DISTANCES = np.array([1e-4, 5e-3, _FULL, 0.03, _FADES, 0.2, 1.0])


def test_the_force_is_the_slope_of_the_loss():
    h = 1e-7
    share, _ = pull(DISTANCES)
    slope = (pull(DISTANCES + h)[1] - pull(DISTANCES - h)[1]) / (2 * h)
    np.testing.assert_allclose(share * DISTANCES, slope, rtol=1e-4)


def test_the_pull_is_full_at_a_centimetre_and_fades_out_of_reach():
    force = DISTANCES * pull(DISTANCES)[0]
    np.testing.assert_allclose(force[:2], DISTANCES[:2])
    np.testing.assert_allclose(force[2:5], _FULL)
    assert force[5] == pytest.approx(_FULL * 0.16) and force[6] < 0.01 * _FULL


def test_nothing_pulls_where_there_is_no_gap():
    share, loss = pull(np.zeros(1))
    assert np.isfinite(share).all() and loss[0] == pytest.approx(0.0, abs=1e-20)
