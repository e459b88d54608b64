import numpy as np
from scipy.spatial.transform import Rotation

from omni_envs.retargeting.first_frame import aligned_poses
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.robots import G1
from omni_envs.scenes import Scene


def test_the_first_start_is_the_rigid_fit():
    configuration = Kinematics(G1, Scene())
    turn = Rotation.from_euler("zyx", [2.0, 0.1, -0.05])
    q = G1.default_qpos.copy()
    q[:3], q[3:7] = (1.0, -2.0, 0.9), turn.as_quat(scalar_first=True)
    configuration.update(q)
    keypoints = configuration.keypoints().copy()
    poses = aligned_poses(configuration, keypoints)
    assert len(poses) == 4
    configuration.update(poses[0])
    np.testing.assert_allclose(configuration.keypoints(), keypoints, atol=1e-9)
    for pose in poses[1:]:
        np.testing.assert_allclose(np.linalg.norm(pose[3:7]), 1.0)
        np.testing.assert_array_equal(pose[7:], G1.default_qpos[7:])
