from dataclasses import replace

import numpy as np

from omni_envs.retargeting.surface_points import surface_points
from omni_envs.scenes import Box, Part, Scene, Terrain


def test_object_points_lie_on_the_object_and_shrink_with_the_source(grasp):
    points = surface_points(grasp, 60)
    (part,) = grasp.scene.object.parts
    largest = np.abs(points.target / np.array(part.shape.half_extents)).max(axis=1)
    np.testing.assert_allclose(largest, 1.0, atol=1e-9)
    np.testing.assert_allclose(points.source, grasp.scale * points.target)
    np.testing.assert_array_equal(points.target, surface_points(grasp, 60).target)


def test_points_spread_evenly_and_more_on_top_of_terrain(grasp):
    terrain = Terrain((Part(Box((0.5, 0.5, 0.5))),))
    source = replace(
        grasp, scene=Scene(terrain=terrain), object_poses=None, source_object_poses=None
    )
    points = surface_points(source, 100).target
    gap = np.linalg.norm(points[:, None] - points[None], axis=-1) + 9 * np.eye(100)
    assert gap.min() > 0.05
    top = (points[:, 2] > 0.499).sum()
    assert top > 100 / 6 * 2


def test_ground_follows_the_body(grasp):
    source = replace(grasp, scene=Scene(), object_poses=None, source_object_poses=None)
    points = surface_points(source, 100).target
    assert points.shape == (60, 81, 3) and not points[..., 2].any()
    centre = points[:, :, :2].mean(axis=1)
    assert np.abs(centre - source.keypoints[:, 0, :2]).max() < 0.3
