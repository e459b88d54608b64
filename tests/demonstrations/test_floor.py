import numpy as np
import pytest

from omni_envs.demonstrations.floor import level_floor


def walk(length=6.0, frames=180):
    """Toes that stand and swing by turns along x, the feet 1 cm apart in height."""
    t = np.arange(frames)
    toes = np.zeros((frames, 2, 3))
    for foot in range(2):
        phase = (t / 30 + 0.5 * foot) % 1
        step = np.floor(t / 30 + 0.5 * foot) + np.clip((phase - 0.6) / 0.4, 0, 1)
        toes[:, foot, 0] = length * step / (frames / 30)
        toes[:, foot, 1] = 0.2 * foot
        toes[:, foot, 2] = (
            0.02 + 0.01 * foot + 0.1 * np.sin(np.pi * np.clip((phase - 0.6) / 0.4, 0, 1))
        )
    return toes


@pytest.mark.parametrize("slope", [0.013, -0.02])
def test_tilt_is_taken_out(slope):
    toes = walk()
    tilted = toes + np.array([0, 0, 1.0]) * slope * toes[..., :1]
    levelled = level_floor(tilted, tilted, 30.0)
    np.testing.assert_array_equal(levelled[..., :2], toes[..., :2])
    change = levelled[..., 2] - toes[..., 2]
    assert np.ptp(change) < 2e-3


@pytest.mark.parametrize(("length", "slope"), [(0.6, 0.02), (6.0, 0.2)])
def test_too_little_ground_or_a_true_slope_is_left_alone(length, slope):
    toes = walk(length)
    tilted = toes + np.array([0, 0, 1.0]) * slope * toes[..., :1]
    np.testing.assert_array_equal(level_floor(tilted, tilted, 30.0), tilted)


def test_a_short_clip_is_left_alone():
    toes = np.zeros((3, 2, 3))
    assert level_floor(toes, toes, 30.0) is toes


def test_unrecorded_steps_are_not_a_slope():
    """Someone walks onto a box: a plane through the footholds would tilt everything else."""
    frames = 400
    t = np.arange(frames)
    toes = np.zeros((frames, 2, 3))
    for foot in range(2):
        step = (t + 20 * foot) // 40
        toes[:, foot, 0] = 0.5 * step  # a new foothold every 40 frames
        toes[:, foot, 2] = np.where(step >= 7, 0.2, 0.0)
    positions = toes.copy()
    np.testing.assert_array_equal(level_floor(positions, toes, 30.0), positions)
    toes[..., 2] = 0.01 * toes[..., 0]  # a tilt, and only that, goes
    levelled = level_floor(toes, toes, 30.0)
    assert np.ptp(levelled[..., 2]) < 1e-6


def test_one_foot_that_never_stands():
    frames = 60
    toes = np.zeros((frames, 2, 3))
    toes[:, 0, 0] = np.arange(frames)
    np.testing.assert_array_equal(level_floor(toes, toes, 30.0), toes)
