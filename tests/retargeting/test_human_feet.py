from dataclasses import replace

import numpy as np
import pytest

from omni_envs.retargeting.human_feet import HumanFeet, support_normals
from omni_envs.robots import KEYPOINTS
from omni_envs.scenes import slope_onto_block, uneven_ground

ANGLE = 0.3
SLOPE = slope_onto_block(ANGLE, 0.5, 1.0)
UP, UPHILL = np.array([0.0, 0.0, 1.0]), np.array([-np.sin(ANGLE), 0.0, np.cos(ANGLE)])


def test_normals_are_those_of_the_surface_below_and_vertical_at_edges():
    end = 0.5 / np.tan(ANGLE)
    points = [(-1.0, 0, 0), (0.5, 0.1, 0.5 * np.tan(ANGLE)), (end + 0.3, 0, 0.5), (end, 0, 0.5)]
    found = support_normals(SLOPE.terrain, np.array(points))
    np.testing.assert_allclose(found, [UP, UPHILL, UP, UP], atol=1e-6)
    assert (support_normals(None, np.zeros((2, 3))) == UP).all()
    # A toe that a lowered terrain has left in the air.
    above = np.array([[0.5, 0.1, 0.5 * np.tan(ANGLE) + 0.08]])
    np.testing.assert_array_equal(support_normals(SLOPE.terrain, above), [UP])


def test_uneven_ground_has_normals_too():
    x = np.linspace(-1.0, 1.0, 21)
    field = uneven_ground(np.tile(0.5 + 0.2 * x, (21, 1)), (2.0, 2.0)).terrain
    normal = support_normals(field, np.array([[0.0, 0.0, 0.5]]))[0]
    np.testing.assert_allclose(normal, np.array([-0.2, 0.0, 1.0]) / np.hypot(0.2, 1.0), atol=1e-6)


@pytest.fixture
def climber(grasp):
    """A source whose left toe stands on the slope and rises a little."""
    keypoints = grasp.keypoints[:10].copy()
    toe, ankle = KEYPOINTS.index("left_toe"), KEYPOINTS.index("left_ankle")
    keypoints[:, toe] = [0.5, 0.0, 0.5 * np.tan(ANGLE)]
    keypoints[:, toe, 2] += [0, -0.01, 0, 0.01, 0.02, 0, 0, 0, 0, 0]
    keypoints[:, ankle] = keypoints[:, toe] + [-0.1, 0.0, 0.05]
    return replace(grasp, keypoints=keypoints, scene=SLOPE, object_poses=None)


def test_feet_of_a_source(climber):
    standing = np.zeros((10, 2), bool)
    standing[2:8, 0] = True
    feet = HumanFeet.of(climber, standing)
    np.testing.assert_allclose(feet.axes[2:8, 0] @ UPHILL, 0.0, atol=1e-6)
    np.testing.assert_allclose(feet.axes[2, 0, 0], [np.cos(ANGLE), 0.0, np.sin(ANGLE)], atol=1e-6)
    np.testing.assert_allclose(feet.axes[:2, 0], np.tile(np.eye(3)[:2], (2, 1, 1)))
    np.testing.assert_allclose(feet.rise[2:8, 0], [0, 0.01, 0.02, 0, 0, 0], atol=1e-9)
    assert not feet.rise[:, 1].any() and not feet.pivots.any()


def test_flat_is_who_stands_on_the_whole_sole_of_something(climber):
    standing = np.zeros((10, 2), bool)
    standing[2:8, 0] = True
    toe, ankle, knee = (
        climber.keypoints[:, KEYPOINTS.index(f"left_{joint}")].copy()
        for joint in ("toe", "ankle", "knee")
    )
    toe[:] = toe[2]
    along = np.array([np.cos(ANGLE), 0.0, np.sin(ANGLE)])
    ankle[:] = toe - 0.12 * along + 0.05 * UPHILL
    ankle[4] = toe[4] - 0.08 * along + 0.10 * UPHILL  # the heel is up
    knee[:] = ankle + 0.4 * UPHILL
    knee[6] = ankle[6] - 0.4 * along  # kneeling: the foot lies
    keypoints = climber.keypoints.copy()
    for joint, path in (("toe", toe), ("ankle", ankle), ("knee", knee)):
        keypoints[:, KEYPOINTS.index(f"left_{joint}")] = path
    feet = HumanFeet.of(replace(climber, keypoints=keypoints), standing)
    expected = np.isin(np.arange(10), [2, 3, 5, 7])
    np.testing.assert_array_equal(feet.flat[:, 0], expected)
    assert not feet.flat[:, 1].any()
    np.testing.assert_allclose(feet.support[2:8, 0], toe[2] @ UPHILL, atol=1e-6)
    assert np.isinf(feet.support[:2, 0]).all()


def test_a_foot_on_nothing_has_no_support(climber):
    keypoints = climber.keypoints.copy()
    keypoints[:, KEYPOINTS.index("left_toe"), 2] += 0.2
    standing = np.ones((10, 2), bool)
    feet = HumanFeet.of(replace(climber, keypoints=keypoints), standing)
    assert np.isinf(feet.support[:, 0]).all() and not feet.flat[:, 0].any()
