from dataclasses import replace

import numpy as np

from omni_envs.demonstrations.surface import closest_points
from omni_envs.retargeting.surface_points import surface_points
from omni_envs.scenes import Box, Part, Scene, Terrain, slope_onto_block


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


def crawl(spacing=0.0):
    """A source that goes along x over a slope onto a block, and the block's depth varied."""
    scene = slope_onto_block(0.3, 0.2, 0.5, foot=0.3)
    wider = slope_onto_block(0.3, 0.2, 0.5 + spacing, foot=0.3)
    return scene, wider


def test_ground_beside_terrain_is_near_the_way_and_not_under_terrain(grasp):
    scene, _ = crawl()
    source = replace(grasp, scene=scene, object_poses=None, source_object_poses=None)
    plain, points = surface_points(source, 60), surface_points(source, 60, 40)
    np.testing.assert_array_equal(points.source[:60], plain.source)
    ground = points.source[60:]
    assert len(ground) == 40 and not ground[:, 2].any()
    assert (closest_points(scene.terrain.parts, ground)[1] > 0.0).all()
    way = source.keypoints[:, None, 0, :2] - ground[:, :2]
    assert np.linalg.norm(way, axis=-1).min(axis=0).max() < 2.0
    gap = np.linalg.norm(ground[:, None] - ground[None], axis=-1) + 9 * np.eye(40)
    assert gap.min() > 0.05  # no two in one place
    np.testing.assert_array_equal(points.target, points.source)


def test_ground_goes_with_the_terrain_of_a_variation(grasp):
    scene, wider = crawl(0.3)
    source = replace(grasp, object_poses=None, source_object_poses=None)
    points = surface_points(replace(source, scene=wider, original_scene=scene), 60, 40)
    shift = (points.target - points.source)[60:]
    far = points.source[60:, 0] > 0.3 + 0.2 / np.tan(0.3) + 0.5
    assert not shift[:, 1:].any()
    np.testing.assert_allclose(shift[far, 0], 0.3, atol=1e-9)
    assert not shift[points.source[60:, 0] < 0.3].any()
    free = closest_points(wider.terrain.parts, points.target[60:])[1]
    assert (free[far | (points.source[60:, 0] < 0.3)] > 0.0).all()
