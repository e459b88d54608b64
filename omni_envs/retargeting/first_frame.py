"""A start for the first frame, for any heading, without a nominal pose."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from omni_envs.retargeting.kinematics import Kinematics


def aligned_poses(configuration: Kinematics, keypoints: np.ndarray) -> list[np.ndarray]:
    """Starting configurations for (15, 3) source keypoints, the most promising first.

    The robot's keypoints in its default pose are aligned rigidly with the source (Kabsch), then
    turned by half and quarter turns about the vertical: the mesh alone can confuse left and right.

    Args:
        configuration: Kinematics of the robot; its configuration changes.
        keypoints: World keypoints of the source.

    Returns:
        Four (nq,) configurations.
    """
    q = configuration.robot.default_qpos.copy()
    configuration.update(q)
    own = configuration.keypoints()
    centre, own_centre = keypoints.mean(axis=0), own.mean(axis=0)
    u, _, vt = np.linalg.svd((own - own_centre).T @ (keypoints - centre))
    sign = np.diag([1.0, 1.0, np.linalg.det(vt.T @ u.T)])
    aligned = Rotation.from_matrix(vt.T @ sign @ u.T)
    poses = []
    for turn in (0.0, np.pi, 0.5 * np.pi, -0.5 * np.pi):
        rotation = Rotation.from_rotvec([0.0, 0.0, turn]) * aligned
        pose = q.copy()
        pose[:3] = centre + rotation.apply(q[:3] - own_centre)
        pose[3:7] = rotation.as_quat(scalar_first=True)
        poses.append(pose)
    return poses
