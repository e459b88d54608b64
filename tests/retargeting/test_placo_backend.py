import numpy as np
import pytest

from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.robots import G1

pytest.importorskip("placo")

from omni_envs.retargeting.placo_backend import PlacoKinematics


def test_pinocchio_agrees_on_points_and_jacobians(grasp):
    ours, other = Kinematics(G1, grasp.scene), PlacoKinematics(G1, grasp.scene)
    rng = np.random.default_rng(0)
    for t in (0, 40):
        q = G1.default_qpos.copy()
        q[:3] = grasp.object_poses[t, :3] + [-0.25, 0.05, 0.4]
        q[3:7] = rng.normal(size=4)
        q[3:7] /= np.linalg.norm(q[3:7])
        q[7:] += rng.normal(scale=0.3, size=29)
        for configuration in (ours, other):
            configuration.place_object(grasp.object_poses[t])
            configuration.update(q)
        np.testing.assert_allclose(other.keypoints(), ours.keypoints(), atol=1e-6)
        np.testing.assert_allclose(other.keypoint_jacobians(), ours.keypoint_jacobians(), atol=1e-6)
        np.testing.assert_allclose(other.feet_jacobians(), ours.feet_jacobians(), atol=1e-6)
        rows, others = ContactLimit(0.0).rows(ours), ContactLimit(0.0).rows(other)
        assert rows is not None and others is not None and len(rows.lower) > 3
        np.testing.assert_allclose(others.A, rows.A, atol=1e-6)


def test_placo_solves_the_same_clip(grasp, cut):
    part = cut(grasp, 18, 24)
    other = retarget(part, G1, RetargetOptions(backend="placo"))
    ours = retarget(part, G1)
    np.testing.assert_allclose(other.frames.energy, ours.frames.energy, rtol=0.02)
    assert np.abs(other.qpos - ours.qpos).max() < 0.02
    assert other.frames.relaxed.sum() == 0
