import numpy as np
import pytest

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.demonstrations.source_resampling import resample_source
from omni_envs.errors import InvalidDataError
from omni_envs.scenes import Box, Part, Scene, SceneObject

FRAMES = 31


@pytest.fixture
def source():
    t = np.arange(FRAMES) / 30.0
    poses = np.zeros((FRAMES, 7))
    poses[:, 0], poses[:, 3] = t, 1.0
    stance = np.zeros((FRAMES, 2), bool)
    stance[6:16, 0] = stance[20, 1] = True
    points = np.full((FRAMES, 3), np.nan)
    points[6:16] = np.arange(6, 16)[:, None] * (1.0, 0.0, 0.0)
    return SourceMotion(
        name="test",
        fps=30.0,
        scale=0.7,
        keypoints=np.repeat(t[:, None], 15, axis=1)[..., None] * (1.0, 2.0, 3.0),
        scene=Scene(object=SceneObject("box", (Part(Box((0.1, 0.1, 0.1))),))),
        object_poses=poses,
        source_object_poses=0.7 * poses + (0, 0, 0, 0.3, 0, 0, 0),
        stance={"default": stance},
        contacts={"left_hand": stance[:, 0]},
        contact_points={"left_hand": points},
    )


def test_everything_is_at_the_new_frames(source):
    fast = resample_source(source, 50.0)
    t = np.arange(51) / 50.0
    assert (fast.fps, fast.num_frames) == (50.0, 51)
    np.testing.assert_allclose(fast.keypoints[:, 3], t[:, None] * (1, 2, 3), atol=1e-12)
    np.testing.assert_allclose(fast.object_poses[:, 0], t, atol=1e-12)
    np.testing.assert_allclose(fast.source_object_poses[:, 0], 0.7 * t, atol=1e-12)


def test_schedules_hold_where_both_neighbours_do(source):
    fast = resample_source(source, 50.0)
    t = np.arange(51) / 50.0
    inside = (t >= 6 / 30 - 1e-9) & (t <= 15 / 30 + 1e-9)
    np.testing.assert_array_equal(fast.stance["default"][:, 0], inside)
    np.testing.assert_array_equal(fast.contacts["left_hand"], inside)
    # A single old frame has no two neighbours; it counts only where a new frame falls on it.
    assert not fast.stance["default"][:, 1].any()


def test_touched_points_move_between_frames(source):
    fast = resample_source(source, 50.0)
    points = fast.contact_points["left_hand"]
    touching = fast.contacts["left_hand"]
    assert np.isnan(points[~touching]).all()
    np.testing.assert_allclose(points[touching, 0], np.arange(51)[touching] * 0.6, atol=1e-9)


def test_the_same_rate_changes_nothing(source):
    same = resample_source(source, 30.0)
    np.testing.assert_array_equal(same.keypoints, source.keypoints)
    np.testing.assert_array_equal(same.stance["default"], source.stance["default"])
    np.testing.assert_array_equal(
        same.contact_points["left_hand"], source.contact_points["left_hand"]
    )


def test_bad_rates_are_refused(source):
    with pytest.raises(InvalidDataError, match="new_fps"):
        resample_source(source, 0.0)
