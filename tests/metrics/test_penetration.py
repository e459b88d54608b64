import numpy as np
import pytest

from omni_envs.metrics.penetration import penetration
from omni_envs.metrics.playback import play
from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, SceneObject, Terrain


def depths(qpos, scene, poses=None):
    return penetration(play(G1, scene, 50.0, qpos, poses), scene)


@pytest.mark.parametrize("lift", [-0.012, -0.001, 0.0, 0.02])
def test_depth_in_the_ground_is_how_far_the_soles_are_below(standing, lift):
    found = depths(standing(lift=lift), Scene())
    assert found.keys() == {"ground", "self"}
    assert found["ground"][0] == pytest.approx(max(0.0, -lift), abs=1e-6)


def test_the_default_pose_does_not_penetrate_itself(standing):
    assert depths(standing(), Scene())["self"][0] == 0.0


def test_a_pose_that_runs_into_itself_does(standing):
    qpos = standing()
    for side, sign in (("left", -1.0), ("right", 1.0)):
        qpos[0, 7 + G1.joint_names.index(f"{side}_hip_roll_joint")] = sign * 0.4
    assert depths(qpos, Scene())["self"][0] > 0.01


def test_every_target_has_its_own_column(standing):
    terrain = Terrain((Part(Box((1.0, 1.0, 0.25)), (0.0, 0.0, 0.05)),))  # top at 0.3
    scene = Scene(object=SceneObject("box", (Part(Box((0.1, 0.1, 0.1))),)), terrain=terrain)
    qpos = standing(3, lift=0.29)
    torso = play(G1, Scene(), 50.0, qpos[:1], None)
    middle = torso.positions[0, torso.body_names.index("torso_link")] + (0.0, 0.0, 0.15)
    poses = np.zeros((3, 7))
    poses[:, :3], poses[:, 3] = middle, 1.0
    poses[1, 0] += 2.0
    found = depths(qpos, scene, poses)
    assert found.keys() == {"object", "terrain", "ground", "self"}
    np.testing.assert_allclose(found["terrain"], 0.01, atol=1e-6)
    np.testing.assert_array_equal(found["ground"], 0.0)
    assert found["object"][0] > 0.05
    assert found["object"][1] == 0.0
    assert found["object"][2] == found["object"][0]
