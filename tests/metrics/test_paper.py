import numpy as np
import pytest

from omni_envs.demonstrations import Demonstration
from omni_envs.errors import InvalidDataError
from omni_envs.metrics import paper_figures, paper_row
from omni_envs.metrics.paper import PaperFigures
from omni_envs.metrics.playback import play
from omni_envs.robots import G1, KEYPOINTS
from omni_envs.scenes import Box, Part, Scene, SceneObject

BOX = SceneObject("box", (Part(Box((0.1, 0.1, 0.1))),))


def demonstration(frames, height=G1.height, scene=None, poses=None):
    positions = np.zeros((frames, 15, 3))
    positions[:, :, 0] = 5.0
    return Demonstration(
        name="test",
        fps=30.0,
        joint_names=KEYPOINTS,
        positions=positions,
        keypoint_joints={k: k for k in KEYPOINTS},
        height=height,
        scene=scene or Scene(),
        object_poses=poses,
    )


def test_only_frames_deeper_than_a_centimetre_count(standing):
    qpos = standing(4)
    qpos[:, 2] -= (0.0, 0.009, 0.02, 0.04)
    figures = paper_figures(G1, Scene(), 30.0, qpos)
    assert figures.penetration_duration == 0.5
    assert figures.skating_duration is None and figures.contact is None
    row = paper_row([figures])
    np.testing.assert_allclose(row["penetration_depth_cm"], (3.0, 1.0), atol=1e-3)
    assert row["skating_duration"] is None and row["skating_speed_cm_per_frame"] is None


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_a_slide_is_a_centimetre_per_frame_at_30_fps(standing, fps):
    qpos = standing(6)
    qpos[:, 0] += np.cumsum([0, 0, 0.009, 0.011, 0.02, 0]) * 30.0 / fps
    figures = paper_figures(G1, Scene(), fps, qpos, demonstration=demonstration(6))
    assert figures.stance_frames == 5  # never the first
    assert figures.skating_duration == pytest.approx(2 / 5)
    np.testing.assert_allclose(figures.slides, [0.011, 0.02], atol=1e-9)


@pytest.mark.parametrize(("scene", "planted"), [(Scene(), 5), (Scene(object=BOX), 0)])
def test_stance_is_of_the_scaled_human_except_with_an_object(standing, scene, planted):
    poses = np.tile([9.0, 0, 0, 1, 0, 0, 0], (6, 1)) if scene.object else None
    demo = demonstration(6, 2 * G1.height, scene, poses)
    demo.positions[:, :, 0] += 0.015 * np.arange(6)[:, None]
    figures = paper_figures(G1, scene, 30.0, standing(6), poses, demo)
    assert figures.stance_frames == planted


def test_contact_is_lost_where_a_hand_leaves_the_object(standing):
    scene = Scene(object=BOX)
    near = np.tile([0.0, 0.0, 0.0, 1, 0, 0, 0], (4, 1))
    playback = play(G1, Scene(), 30.0, standing(), None)
    near[:, :3] = playback.keypoints()[0, KEYPOINTS.index("left_hand")]
    demo = demonstration(4, scene=scene, poses=near)
    demo.positions[1:, KEYPOINTS.index("left_hand")] = near[0, :3] + (0.0, 0.0, 0.27)
    far = near.copy()
    far[2:, 0] += 3.0
    assert paper_figures(G1, scene, 30.0, standing(4), near, demo).contact == 1.0
    assert paper_figures(G1, scene, 30.0, standing(4), far, demo).contact == 0.5


def test_a_row_pools_motions():
    motions = [
        PaperFigures(10, np.array([0.02]), np.array([0.03]), 5, 1.0),
        PaperFigures(10, np.array([]), np.array([]), None, None),
    ]
    row = paper_row(motions)
    np.testing.assert_allclose(row["penetration_duration"], (0.05, 0.05))
    np.testing.assert_allclose(row["penetration_depth_cm"], (2.0, 0.0))
    np.testing.assert_allclose(row["skating_duration"], (0.2, 0.0))
    np.testing.assert_allclose(row["skating_speed_cm_per_frame"], (3.0, 0.0))
    np.testing.assert_allclose(row["contact"], (1.0, 0.0))


def test_a_demonstration_of_other_frames_is_refused(standing):
    with pytest.raises(InvalidDataError, match="frames"):
        paper_figures(G1, Scene(), 30.0, standing(4), demonstration=demonstration(5))
