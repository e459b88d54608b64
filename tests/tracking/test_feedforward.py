"""Feed-forward targets, checked on motions whose torques are known and in the physics."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1, H1
from omni_envs.scenes import Box, Part, PhysicsOptions, Scene, SceneObject, build_spec
from omni_envs.tracking.feedforward import action_targets, feedforward_lead, inverse_dynamics

FPS = 50.0


def _standing(frames: int = 12, scene: Scene | None = None, box: np.ndarray | None = None):
    """The robot stands still, its lowest sole sphere on the ground."""
    qpos = np.tile(G1.default_qpos, (frames, 1))
    spec = build_spec(G1, Scene(), PhysicsOptions(), looks=False)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = qpos[0]
    mujoco.mj_kinematics(model, data)
    soles = [g for g in range(model.ngeom) if int(model.geom_type[g]) == 2]
    qpos[:, 2] -= (data.geom_xpos[soles, 2] - model.geom_size[soles, 0]).min()
    poses = None if box is None else np.tile(box, (frames, 1))
    return reference_from_qpos(G1, FPS, qpos, poses, scene or Scene())


def test_the_ground_carries_a_robot_that_stands():
    torques, missing = inverse_dynamics(G1, _standing())
    assert np.abs(missing).max() < 0.5  # of 342 N
    knees = [G1.joint_names.index(f"{side}_knee_joint") for side in ("left", "right")]
    assert (np.abs(torques[:, knees]) > 1.0).all()
    left, right = torques[:, knees].T
    np.testing.assert_allclose(left, right, rtol=0.05)


def test_a_box_on_the_ground_is_not_the_robots_load():
    box = Scene(object=SceneObject("box", (Part(Box((0.1, 0.1, 0.1))),), mass=5.0))
    away = np.array([2.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0])
    with_box = inverse_dynamics(G1, _standing(scene=box, box=away))[0]
    np.testing.assert_allclose(with_box, inverse_dynamics(G1, _standing())[0], atol=0.1)


def test_no_contact_in_reach_leaves_the_weight_unexplained():
    motion = _standing()
    qpos = motion.qpos.copy()
    qpos[:, 2] += 0.5
    _, missing = inverse_dynamics(G1, reference_from_qpos(G1, FPS, qpos))
    spec = build_spec(G1, Scene(), PhysicsOptions(), looks=False)
    weight = 9.81 * spec.compile().body_mass.sum()
    np.testing.assert_allclose(missing[:, 2], weight, rtol=1e-6)


def test_lead_makes_up_for_damping(sway):
    motion = sway(40, with_object=False)
    still = replace(motion, qvel=motion.qvel * 0)
    kp = np.array([a.stiffness for a in G1.actuators])
    kd = np.array([a.damping for a in G1.actuators])
    expected = (kd * motion.joint_velocities + inverse_dynamics(G1, motion)[0]) / kp
    np.testing.assert_allclose(feedforward_lead(G1, motion), expected)
    assert np.abs(feedforward_lead(G1, motion) - feedforward_lead(G1, still)).max() > 0.01


def test_torques_stay_within_the_effort(sway):
    motion = sway(40)
    qpos = motion.qpos.copy()
    qpos[:, 7:] += 0.5 * np.sin(np.arange(40)[:, None] * 2.0)
    wild = reference_from_qpos(G1, FPS, qpos, motion.object_poses, motion.scene)
    effort = np.array([a.effort for a in G1.actuators])
    torques, _ = inverse_dynamics(G1, wild)
    assert np.isfinite(torques).all()
    assert (np.abs(torques) <= effort).all() and (np.abs(torques) == effort).any()


def test_the_robot_stands_longer_on_them_than_on_the_reference():
    """Played back in the physics without any feedback."""
    motion = _standing()
    model = build_spec(G1, Scene(), PhysicsOptions(), looks=False).compile()
    data = mujoco.MjData(model)
    fallen = []
    for mode in ("residual", "feedforward"):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = motion.qpos[0]
        data.ctrl[:] = action_targets(G1, [motion], mode)[0][0]
        for _ in range(80):  # 0.4 s
            mujoco.mj_step(model, data)
        fallen.append(np.abs(data.qpos[7:] - motion.qpos[0, 7:]).max())
    assert fallen[1] < 0.3 * fallen[0]


@pytest.mark.parametrize("robot", [G1, H1], ids=lambda r: r.name)
def test_targets_have_the_shape_of_the_motion(robot):
    motion = reference_from_qpos(robot, FPS, np.tile(robot.default_qpos, (5, 1)))
    for mode in ("residual", "feedforward"):
        (targets,) = action_targets(robot, [motion], mode)
        assert targets.shape == motion.joint_positions.shape
