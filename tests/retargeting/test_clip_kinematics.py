import numpy as np

from omni_envs.retargeting.clip_kinematics import trace_clip
from omni_envs.retargeting.kept_stance import foot_points
from omni_envs.retargeting.kinematics import Kinematics, Points
from omni_envs.robots import G1
from omni_envs.scenes import Scene


def test_all_frames_at_once_are_the_frames_one_by_one():
    kinematics = Kinematics(G1, Scene())
    points = Points(kinematics.model, *foot_points(G1))
    rng = np.random.default_rng(0)
    low, high = G1.joint_ranges.T
    qpos = np.tile(G1.default_qpos, (6, 1))
    qpos[:, :7] += 0.3 * rng.normal(size=(6, 7))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    qpos[:, 7:] = rng.uniform(low, high, (6, G1.num_joints))
    placed, visited = [], []
    trace = trace_clip(kinematics, points, qpos, 1, 5, placed.append, visited.append)
    assert placed == visited == [1, 2, 3, 4]
    for i, q in enumerate(qpos[1:5]):
        kinematics.update(q)
        positions = kinematics.positions(points)
        np.testing.assert_allclose(trace.positions[i], positions, atol=1e-12)
        expected = kinematics.jacobians(points, positions)
        np.testing.assert_allclose(trace.jacobians[i], expected, atol=1e-12)
