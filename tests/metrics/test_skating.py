import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.metrics.playback import play
from omni_envs.metrics.skating import (
    counted_stance,
    intervals,
    slip_speed,
    stance_drift,
    support_normals,
)
from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, Terrain

UP = np.array([0.0, 0.0, 1.0])
SOLE = np.array(G1.feet["left"].sole)


def feet(frames: int) -> np.ndarray:
    """(T, 2, K, 3) resting soles."""
    return np.tile(SOLE, (frames, 2, 1, 1))


def up(frames: int) -> np.ndarray:
    return np.tile(UP, (frames, 2, 1))


def rolled(angles: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """(T, 2, K, 3) soles that pitch about a point of them."""
    turn = rotations.exp(np.stack([0 * angles, angles, 0 * angles], axis=1))
    soles = pivot + rotations.rotate(turn[:, None], (SOLE - pivot)[None])
    return np.repeat(soles[:, None], 2, axis=1)


def test_slip_is_the_speed_along_the_ground():
    soles = feet(3)
    soles[1:, 0, :, 0] += 0.003
    soles[1:, 0, :, 1] += 0.004
    soles[2:, 1, :, 2] += 0.01  # lifting is not slip
    np.testing.assert_allclose(slip_speed(soles, up(3), 50.0), [[0, 0], [0.25, 0], [0, 0]])


def test_rolling_over_the_toe_is_neither_slip_nor_pivot_drift():
    soles = rolled(np.linspace(0, 0.6, 10), SOLE[-1])
    assert slip_speed(soles, up(10), 50.0).max() < 1e-9
    stance = np.ones((10, 2), bool)
    centre, still, pivot = stance_drift(soles, up(10), stance, stance & False)
    assert pivot.max() < 1e-9
    np.testing.assert_array_equal(still, centre)  # the human did not roll
    arm = SOLE[-1, 0] - SOLE[:-1, 0].mean()
    expected = arm * (1 - np.cos(np.linspace(0, 0.6, 10)))
    np.testing.assert_allclose(centre[:, 0], expected, atol=1e-9)


def test_what_rolls_with_the_human_is_still_before_and_after():
    angles = np.concatenate([np.zeros(4), np.linspace(0, 0.6, 5)[1:-1], np.full(4, 0.6)])
    soles = rolled(angles, SOLE[-1])
    soles[9:, :, :, 0] += 0.003
    stance, pivots = np.ones((11, 2), bool), np.zeros((11, 2), bool)
    pivots[4:7] = True
    centre, still, pivot = stance_drift(soles, up(11), stance, pivots)
    assert np.isnan(still[4:7]).all()
    np.testing.assert_allclose(still[[0, 3, 7, 8], 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(still[9:, 0], 0.003, atol=1e-9)
    np.testing.assert_allclose(pivot[9:, 0], 0.003, atol=1e-9)
    assert centre[7:, 0].min() > 0.015


def test_turning_on_the_spot_slips_like_its_slowest_point():
    turn = rotations.exp(np.array([[0, 0, 0.0], [0, 0, 0.1]]))
    soles = np.repeat(rotations.rotate(turn[:, None], SOLE[None])[:, None], 2, axis=1)
    slowest = 2 * np.sin(0.05) * np.linalg.norm(SOLE[:, :2], axis=1).min()
    np.testing.assert_allclose(slip_speed(soles, up(2), 1.0)[1], slowest, atol=1e-9)


def test_on_a_slope_slip_is_along_the_slope():
    normal = np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    along = np.array([np.cos(0.3), 0.0, -np.sin(0.3)])
    normals = np.tile(normal, (3, 2, 1))
    soles = feet(3)
    soles[1:, 0] += 0.01 * normal
    soles[2:, 1] += 0.01 * along
    np.testing.assert_allclose(
        slip_speed(soles, normals, 1.0), [[0, 0], [0, 0], [0, 0.01]], atol=1e-12
    )


def test_drift_counts_from_the_start_of_each_interval():
    soles = feet(6)
    soles[..., 0] += np.array([0, 1, 2, 4, 5, 9])[:, None, None] * 0.01
    stance = np.zeros((6, 2), bool)
    stance[[0, 1, 3, 4, 5], 0] = True
    for drift in stance_drift(soles, up(6), stance, stance & False):
        np.testing.assert_allclose(drift[:, 0], [0, 0.01, np.nan, 0, 0.01, 0.05], atol=1e-12)
        assert np.isnan(drift[:, 1]).all()


def test_a_frame_counts_when_it_and_the_one_before_are_planted():
    flags = np.array([1, 1, 0, 1, 0, 1, 1, 1], bool)
    counted = counted_stance(np.stack([flags, ~flags], axis=1))
    assert counted[:, 0].tolist() == [False, True, False, False, False, False, True, True]
    assert not counted[:, 1].any()


def test_intervals():
    flags = np.array([1, 1, 0, 1, 0, 0, 1], bool)
    assert list(intervals(flags)) == [(0, 2), (3, 4), (6, 7)]
    assert list(intervals(np.zeros(3, bool))) == []


@pytest.mark.parametrize("angle", [0.0, 0.2])
def test_the_support_is_what_the_foot_stands_on(standing, angle):
    turn = rotations.exp(np.array([0.0, angle, 0.0]))
    normal = rotations.rotate(turn, UP)
    centre = tuple(-0.5 * normal + (0.0, 0.0, 1.0))  # the top goes through (0, 0, 1)
    scene = Scene(terrain=Terrain((Part(Box((1.0, 1.0, 0.5)), centre, tuple(turn)),)))
    flat = standing(1)
    qpos = np.repeat(flat, 2, axis=0)
    qpos[:, :3] = rotations.rotate(turn, flat[0, :3])
    qpos[:, 3:7] = rotations.multiply(turn, flat[0, 3:7])
    qpos[:, 2] += (1.0, 1.5)  # the second in the air
    found = support_normals(play(G1, scene, 50.0, qpos, None))
    np.testing.assert_allclose(found[0], [normal, normal], atol=1e-3)
    np.testing.assert_allclose(found[1], [UP, UP])


def test_a_wall_beside_the_foot_is_no_support(standing):
    wall = Part(Box((0.2, 1.0, 0.5)), (0.385, 0.0, 0.5))  # the toes are a little inside it
    scene = Scene(terrain=Terrain((wall,)))
    found = support_normals(play(G1, scene, 50.0, standing(), None))
    np.testing.assert_allclose(found[0], [UP, UP], atol=1e-6)
