from dataclasses import replace

import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.demonstrations import (
    Variation,
    builtin_demonstration,
    scale_demonstration,
    vary,
)
from omni_envs.demonstrations.source_resampling import resample_source
from omni_envs.demonstrations.variation import HEIGHTS
from omni_envs.errors import InvalidOptionError
from omni_envs.retargeting.surface_points import surface_points
from omni_envs.robots import G1, KEYPOINTS
from omni_envs.scenes import Box, Part, Scene, Terrain


@pytest.fixture(scope="module")
def carry():
    return scale_demonstration(builtin_demonstration("box_carry"), G1.height)


@pytest.fixture
def climb(carry):
    """Someone who walks towards a platform, turned by 30° about the vertical."""
    half = np.deg2rad(15)
    parts = (Part(Box((0.4, 0.6, 0.35)), (2.0, 0.5, 0.35), (np.cos(half), 0, 0, np.sin(half))),)
    touched = np.full((carry.num_frames, 3), np.nan)
    touched[50:] = (2.0, 0.5, 0.7)
    return replace(
        carry,
        scene=Scene(terrain=Terrain(parts)),
        object_poses=None,
        source_object_poses=None,
        contacts={"left_hand": ~np.isnan(touched[:, 0])},
        contact_points={"left_hand": touched},
    )


def onset(source):
    steps = source.fps * np.linalg.norm(np.diff(source.object_poses, axis=0), axis=1)
    return int(np.flatnonzero(steps > 0.075)[0])


def test_start_moves_by_what_is_asked_in_the_humans_frame(carry):
    moved = vary(carry, Variation(object_translation=(0.2, 0.1)))
    shift = (moved.object_poses - carry.object_poses)[:, :3]
    ahead = carry.object_poses[0, :2] - carry.keypoints[0, KEYPOINTS.index("pelvis"), :2]
    ahead /= np.linalg.norm(ahead)
    assert shift[0, :2] @ ahead == pytest.approx(0.2)
    assert ahead[0] * shift[0, 1] - ahead[1] * shift[0, 0] == pytest.approx(0.1)
    assert (shift[:, 2] == 0).all()
    begins = onset(carry)
    np.testing.assert_allclose(shift[: begins + 1], shift[:1].repeat(begins + 1, 0), atol=1e-12)
    # One time constant of 50/30 s later 1/e of it is left.
    later = begins + round(50 / 30 * carry.fps)
    np.testing.assert_allclose(shift[later], shift[0] / np.e, atol=1e-12)
    assert np.linalg.norm(shift[-1]) < 0.01  # the end is kept


def test_turn_is_about_the_vertical_and_fades_twice_as_fast(carry):
    turned = vary(carry, Variation(object_yaw=np.pi / 4))
    difference = rotations.multiply(
        turned.object_poses[:, 3:], rotations.conjugate(carry.object_poses[:, 3:])
    )
    vectors = rotations.log(difference)
    np.testing.assert_allclose(vectors[0], [0, 0, np.pi / 4], atol=1e-9)
    later = onset(carry) + round(25 / 30 * carry.fps)
    assert vectors[later, 2] == pytest.approx(np.pi / 4 / np.e, rel=1e-6)
    np.testing.assert_array_equal(turned.object_poses[:, :3], carry.object_poses[:, :3])


def test_source_mesh_is_kept(carry):
    changed = Variation(object_translation=(0.2, 0), object_yaw=0.3, object_scale=(1.2, 0.9, 1.1))
    varied = vary(carry, changed)
    for name in ("keypoints", "source_object_poses"):
        np.testing.assert_array_equal(getattr(varied, name), getattr(carry, name))
    before, after = surface_points(carry, 60), surface_points(varied, 60)
    np.testing.assert_array_equal(before.source, after.source)
    np.testing.assert_allclose(after.target, before.target * (1.2, 0.9, 1.1), atol=1e-12)


def test_object_of_another_size_stands_where_it_stood(carry):
    bigger = vary(carry, Variation(object_scale=(1.0, 1.0, 1.2)))

    def lowest(source, t):
        pose, corners = source.object_poses[t], source.scene.object.surface().vertices
        turns = np.tile(pose[3:], (len(corners), 1))
        return pose[2] + rotations.rotate(turns, corners)[:, 2].min()

    for t in (0, 200, carry.num_frames - 1):
        assert lowest(bigger, t) == pytest.approx(lowest(carry, t), abs=1e-12)
    held = np.flatnonzero(carry.contacts["left_hand"])[0]
    np.testing.assert_allclose(
        bigger.contact_points["left_hand"][held],
        carry.contact_points["left_hand"][held] * (1, 1, 1.2),
    )


@pytest.mark.parametrize("variation", HEIGHTS)
def test_height_of_a_terrain(climb, variation):
    varied = vary(climb, variation)
    ratio = variation.terrain_height
    bounds = varied.scene.terrain.surface().bounds
    np.testing.assert_allclose(bounds[:, 2], (0, 0.7 * ratio), atol=1e-12)
    np.testing.assert_allclose(
        bounds[:, :2], climb.scene.terrain.surface().bounds[:, :2], atol=1e-12
    )
    assert isinstance(varied.scene.terrain.parts[0].shape, Box)
    touched = varied.contact_points["left_hand"]
    np.testing.assert_allclose(touched[60], (2.0, 0.5, 0.7 * ratio))
    assert np.isnan(touched[0]).all()


def test_depth_grows_away_from_the_human_and_keeps_the_box(climb):
    varied = vary(climb, Variation(terrain_depth=1.5))
    (part,), (old,) = varied.scene.terrain.parts, climb.scene.terrain.parts
    np.testing.assert_allclose(part.shape.half_extents, (0.6, 0.6, 0.35), atol=1e-9)
    assert part.quaternion == old.quaternion
    axis = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    near = [np.array(p.position[:2]) @ axis - p.shape.half_extents[0] for p in (part, old)]
    assert near[0] == pytest.approx(near[1])
    across = [np.array(p.position[:2]) @ (-axis[1], axis[0]) for p in (part, old)]
    assert across[0] == pytest.approx(across[1])
    # The touched middle of the top stays the middle of the top.
    touched = varied.contact_points["left_hand"][60]
    np.testing.assert_allclose(touched, (*part.position[:2], 0.7), atol=1e-9)


def test_parts_askew_become_meshes(climb):
    other = Part(Box((0.1, 0.1, 0.1)), (2.0, 0.5, 0.1))
    terrain = Terrain((*climb.scene.terrain.parts, other))
    varied = vary(replace(climb, scene=Scene(terrain=terrain)), Variation(terrain_depth=1.5))
    kinds = [isinstance(p.shape, Box) for p in varied.scene.terrain.parts]
    assert kinds == [True, False]
    volumes = [p.mesh().volume for p in varied.scene.terrain.parts]
    np.testing.assert_allclose(volumes[1], 1.5 * 0.2**3, rtol=1e-9)


def test_far_from_the_object_the_mesh_sees_it_where_it_was(carry):
    varied = vary(carry, Variation(object_translation=(0.0, 0.2), object_yaw=0.5))
    old, new, seen = carry.object_poses, varied.object_poses, varied.mesh_object_poses
    # The human starts 1.2 m from the box and comes to it before it moves.
    assert np.abs(seen[0] - old[0]).max() < 0.15 * np.abs(new[0] - old[0]).max()
    begins = onset(carry)
    np.testing.assert_allclose(seen[begins], new[begins], atol=1e-9)
    assert np.abs(np.diff(seen[:, :3], axis=0)).max() * carry.fps < 1.0
    np.testing.assert_allclose(np.linalg.norm(seen[:, 3:], axis=1), 1.0, atol=1e-9)


@pytest.mark.parametrize("fps", [30.0, 50.0, 120.0])
def test_feet_that_stand_stand_from_the_first_frame(carry, fps):
    source = resample_source(carry, fps)
    varied = vary(source, Variation(object_yaw=0.1))
    for mode, stance in varied.stance.items():
        assert stance.shape == source.stance[mode].shape
        assert stance[0].all() and not source.stance[mode][0].any()  # box_carry starts standing
        later = int(np.ceil(fps / 30.0))
        np.testing.assert_array_equal(stance[later:], source.stance[mode][later:])


def test_a_variation_of_nothing_changes_nothing(carry):
    same = vary(carry, Variation())
    assert same.name == carry.name and same.original_scene is None
    np.testing.assert_array_equal(same.object_poses, carry.object_poses)


def test_what_is_not_there_cannot_be_varied(carry, climb):
    with pytest.raises(InvalidOptionError, match="no terrain"):
        vary(carry, Variation(terrain_height=1.1))
    with pytest.raises(InvalidOptionError, match="no object"):
        vary(climb, Variation(object_yaw=0.1))
    with pytest.raises(InvalidOptionError, match="variation already"):
        vary(vary(carry, Variation(object_scale=(1, 1, 2))), Variation(object_yaw=0.1))
