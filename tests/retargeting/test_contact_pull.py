import numpy as np
import pytest

from omni_envs.retargeting.contact_pull import FADES, FULL, SOFT, nearest_box, pull, pulls
from omni_envs.rotations import exp, rotate

rng = np.random.default_rng(0)
BESIDE = [-0.05, -SOFT, 0.0, 1e-4, 5e-3, 0.03, 0.079, 0.2, 1.0]


def force(distance):
    return pull(distance)[1]


@pytest.mark.parametrize("distance", BESIDE)
def test_the_slope_is_that_of_the_loss(distance):
    h = 1e-7
    slope = (pull(distance + h)[0] - pull(distance - h)[0]) / (2 * h)
    assert force(distance) == pytest.approx(slope, rel=1e-4, abs=1e-10)


@pytest.mark.parametrize("distance", [-0.02, -SOFT, 0.0, SOFT, 0.009])
def test_the_curvature_of_small_gaps_is_that_of_the_loss(distance):
    h = 1e-5
    assert pull(distance)[2] == pytest.approx(
        (force(distance + h) - force(distance - h)) / (2 * h), rel=1e-2, abs=1e-6
    )


@pytest.mark.parametrize("distance", [0.02, 0.05, 0.1, 0.5])
def test_the_parabola_lies_above_the_loss_of_large_gaps(distance):
    value, slope, curvature = pull(distance)
    for step in np.linspace(-1.2 * distance, distance, 40):
        assert pull(distance + step)[0] <= value + slope * step + 0.5 * curvature * step**2 + 1e-9


def test_the_pull_is_full_at_a_centimetre_and_fades_out_of_reach():
    assert force(5e-3) == pytest.approx(5e-3, rel=0.1)
    assert [force(d) for d in (0.015, 0.03, FADES)] == pytest.approx([FULL] * 3, rel=0.02)
    assert force(0.2) == pytest.approx(FULL * 0.16, rel=1e-3) and force(1.0) < 0.01 * FULL


def test_nothing_pulls_deep_in_the_dead_zone():
    value, slope, curvature = pull(-0.01)
    assert value < 1e-7 and 0.0 < slope < 1e-5 and curvature < 0.02


def test_nearest_box():
    half, radius = np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.1]]), np.array([0.0, 0.05])
    centres, turns = rng.normal(size=(2, 3)), exp(rng.normal(size=(2, 3)))
    matrices = np.stack([rotate(turns, np.tile(axis, (2, 1))) for axis in np.eye(3)], axis=-1)
    geoms, rows = np.arange(2), matrices.reshape(2, 9)
    for i in range(2):
        axis = rotate(turns[i], np.array([0.0, 0.0, 1.0]))
        place = centres[i] + (half[i, 2] + 0.07) * axis
        found, unit, length, beyond = nearest_box(centres, rows, geoms, half, radius, place)
        assert found == i and length == pytest.approx(0.07)
        # A box of no width is always beside the place.
        expected = np.eye(3) if i else np.outer(axis, axis)
        np.testing.assert_allclose(beyond, expected, atol=1e-12)
        np.testing.assert_allclose(unit, axis, atol=1e-12)
    found, unit, length, beyond = nearest_box(centres, rows, geoms, half, radius, centres[0])
    assert found == 0 and length == 0.0 and not unit.any() and not beyond.any()


@pytest.mark.parametrize("way", [(0.0, 0.0, 0.305), (0.105, 0.204, 0.0), (0.103, 0.203, 0.304)])
def test_the_model_has_the_derivatives_of_the_loss(way):
    """Of a box that moves, off face, edge and corner, where the loss is a parabola."""
    half, at = np.array([[0.1, 0.2, 0.3]]), np.zeros((1, 3))
    matrix, geoms, radius = np.eye(3).reshape(1, 9), np.arange(1), np.zeros(1)

    def nearest(move):
        return nearest_box(at + move, matrix, geoms, half, radius, np.array(way))

    def value(move):
        return 3.0 * pull(nearest(move)[2])[0]

    _, unit, length, beyond = nearest(np.zeros(3))
    jacobian = np.eye(3)[:, None]
    arrays = unit[None], np.array([length]), np.array([length]), beyond[None], np.array([3.0])
    H, g, total = pulls(jacobian, *arrays)
    assert total == pytest.approx(value(np.zeros(3)))
    h, eye = 1e-5, np.eye(3)
    slopes = [(value(h * axis) - value(-h * axis)) / (2 * h) for axis in eye]
    np.testing.assert_allclose(g, slopes, atol=1e-6)
    bends = [
        [
            (value(h * (a + b)) - value(h * (a - b)) - value(h * (b - a)) + value(-h * (a + b)))
            / (4 * h * h)
            for b in eye
        ]
        for a in eye
    ]
    np.testing.assert_allclose(H, bends, atol=0.02)
