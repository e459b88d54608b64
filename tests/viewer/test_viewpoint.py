from dataclasses import replace

import numpy as np
import pytest

from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1, get_robot, robot_names
from omni_envs.scenes import Box, HeightField, Part, Scene, Terrain
from omni_envs.scenes.rendering import Camera, camera_pose
from omni_envs.viewer.viewpoint import choose_camera


def standing(yaw=0.0, scene=None):
    qpos = np.tile(G1.default_qpos, (20, 1))
    qpos[:, 3], qpos[:, 6] = np.cos(yaw / 2), np.sin(yaw / 2)
    return reference_from_qpos(G1, 50.0, qpos, scene=scene or Scene())


def seen_from(reference):
    """Where the camera is, in the robot's frame: ahead and to the left."""
    eye, at = camera_pose(choose_camera(reference), G1, reference.qpos[0])
    w, z = reference.qpos[0, [3, 6]]
    yaw = 2 * np.arctan2(z, w)
    x, y = (eye - at)[:2]
    return np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x


@pytest.mark.parametrize("yaw", [0.0, 2.0, -1.0])
def test_on_flat_ground_from_the_front_right_of_the_robot(yaw):
    ahead, left = seen_from(standing(yaw))
    assert ahead > 1.0 and left < -1.0


def test_from_the_side_where_no_terrain_is_in_the_way():
    def blocks(x, y):
        return Scene(terrain=Terrain((Part(Box((0.3, 2.0, 1.0)), (x, y, 1.0)),)))

    assert seen_from(standing(scene=blocks(0.8, 0.0)))[0] < -1.0
    assert seen_from(standing(scene=blocks(-0.8, 0.0)))[0] > 1.0
    wall = Scene(terrain=Terrain((Part(Box((3.0, 0.1, 1.0)), (0.0, -0.5, 1.0)),)))
    assert seen_from(standing(scene=wall))[1] > 1.0


def test_from_above_a_pit():
    pit = np.full((41, 41), 0.5)
    pit[13:28, 13:28] = 0.0
    field = HeightField(pit, (4.0, 4.0))
    camera = choose_camera(standing(scene=Scene(terrain=Terrain((), field))))
    assert camera.elevation < -20


@pytest.mark.parametrize("name", robot_names())
def test_every_robot_fits_into_the_picture(name):
    robot = get_robot(name)
    eye, at = camera_pose(Camera(), robot, robot.default_qpos)
    ahead = (at - eye) / np.linalg.norm(at - eye)
    up = np.array([0, 0, 1.0]) - ahead[2] * ahead
    up /= np.linalg.norm(up)
    angles = []
    for z in (0.0, robot.height):
        to = np.array([0.0, 0.0, z]) - eye
        angles.append(np.rad2deg(np.arctan2(to @ up, to @ ahead)))
    # MuJoCo's field of view is 45° high: some air above and below, but not much.
    assert -21 < angles[0] < -12 and 12 < angles[1] < 21


def test_a_point_of_ones_own_stays():
    camera = replace(Camera(), look_at=(1.0, 2.0, 3.0), distance=2.0)
    eye, at = camera_pose(camera, G1, G1.default_qpos)
    assert at.tolist() == [1, 2, 3] and np.linalg.norm(eye - at) == pytest.approx(2)
