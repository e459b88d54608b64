import numpy as np
import pytest

from omni_envs.demonstrations.builtin.motion import (
    FootShape,
    Step,
    balanced_com,
    bump,
    foot_paths,
    keyframes,
    pressure_points,
    ramp,
    support_weights,
)

DT = 1 / 120
TIME = np.arange(0, 4, DT)
STEPS = (Step(0, 1.0, 1.5, (0.4, 0.1), 0.2), Step(1, 1.7, 2.2, (0.4, -0.1), 0.2))
START = [(0.0, 0.1), (0.0, -0.1)]


def jumps(values):
    """Largest step of the second derivative over its range: small where it is continuous."""
    acceleration = np.diff(values, 2, axis=0) / DT**2
    return np.abs(np.diff(acceleration, axis=0)).max() / np.abs(acceleration).max()


def test_curves_start_end_and_are_smooth():
    for curve in (ramp(TIME, 1, 2), bump(TIME, 1, 2)):
        assert curve[0] == 0 and jumps(curve) < 0.12
    assert ramp(TIME, 1, 2)[-1] == 1 and bump(TIME, 1, 2)[-1] == 0
    assert bump(np.array([1.5]), 1, 2)[0] == 1
    keyed = keyframes(TIME, [(0.5, 2.0), (1.0, 3.0), (2.0, 3.0), (3.0, -1.0)])
    np.testing.assert_allclose(np.interp([0, 1.0, 1.7, 3.5], TIME, keyed), [2, 3, 3, -1])


def test_feet_stand_still_and_land_where_planned():
    toes, yaw, pitch, share = foot_paths(TIME, STEPS, START, 0.06, FootShape())
    standing = (TIME < 1.0) | (TIME > 1.5 + 0.16)
    speed = np.linalg.norm(np.diff(toes[:, 0], axis=0), axis=1) / DT
    assert speed[standing[1:] & standing[:-1]].max() < 1e-9
    np.testing.assert_allclose(toes[-1], [[0.4, 0.1, 0.02], [0.4, -0.1, 0.02]], atol=1e-12)
    np.testing.assert_allclose(yaw[-1], 0.2)
    np.testing.assert_allclose(pitch[[0, -1]], 0.0, atol=1e-12)
    assert pitch.max() == pytest.approx(0.30, abs=0.01)
    assert pitch.min() == pytest.approx(-0.14, abs=0.01)
    assert np.all((share > -1e-9) & (share < 1 + 1e-9))
    assert toes[..., 2].min() > 0.0199 and toes[..., 2].max() > 0.075


def test_heel_never_goes_through_the_ground():
    shape = FootShape()
    toes, _, pitch, _ = foot_paths(TIME, STEPS, START, 0.06, shape)
    heel = toes[..., 2] + shape.heel * np.sin(pitch) - shape.ball_height * np.cos(pitch)
    assert heel.min() > -1e-9


def test_weight_is_on_the_standing_foot():
    right = support_weights(TIME, STEPS)
    assert right[0] == right[-1] == 0.5
    assert np.all(right[(TIME >= 1.0) & (TIME <= 1.5)] == 1)
    np.testing.assert_allclose(right[(TIME >= 1.7) & (TIME <= 2.2)], 0.0, atol=1e-12)


def test_pressure_is_under_the_ball_when_the_heel_rises():
    behind = pressure_points(TIME, STEPS)
    assert behind[0, 0] == 0.085
    assert np.interp(0.95, TIME, behind[:, 0]) == pytest.approx(0.01)
    assert behind[-1, 0] == pytest.approx(0.085)


def test_balanced_com_has_the_given_zero_moment_point():
    zmp = np.stack([0.1 * ramp(TIME, 1, 1.2), 0.1 * bump(TIME, 2, 3)], axis=1)
    com = balanced_com(zmp, DT, 0.9)
    acceleration = np.gradient(np.gradient(com, DT, axis=0), DT, axis=0)
    np.testing.assert_allclose((com - 0.9 / 9.81 * acceleration)[5:-5], zmp[5:-5], atol=2e-3)
    np.testing.assert_allclose(com[0], 0.0, atol=0.01)
    assert com[np.searchsorted(TIME, 1.0), 0] > 0.02  # it moves before its support does
