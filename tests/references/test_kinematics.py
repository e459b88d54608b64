import mujoco
import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.errors import InvalidDataError
from omni_envs.references import reference_from_qpos
from omni_envs.references.kinematics import generalized_velocities, pose_velocities
from omni_envs.robots import G1

FPS = 50.0


def differences(values, fps):
    """Central differences of (T, …) values on frames 1 … T-2."""
    return (values[2:] - values[:-2]) * (0.5 * fps)


def test_generalized_velocities_are_mujocos_tangent_vectors(smooth_qpos):
    qpos = smooth_qpos()
    qvel = generalized_velocities(qpos, FPS)
    before, after = np.empty(G1.nv), np.empty(G1.nv)
    for t in range(1, len(qpos) - 1):
        mujoco.mj_differentiatePos(G1.model, before, 1 / FPS, qpos[t - 1], qpos[t])
        mujoco.mj_differentiatePos(G1.model, after, 1 / FPS, qpos[t], qpos[t + 1])
        np.testing.assert_allclose(qvel[t], 0.5 * (before + after), atol=1e-9)
    mujoco.mj_differentiatePos(G1.model, after, 1 / FPS, qpos[0], qpos[1])
    np.testing.assert_allclose(qvel[0], after, atol=1e-9)
    mujoco.mj_differentiatePos(G1.model, before, 1 / FPS, qpos[-2], qpos[-1])
    np.testing.assert_allclose(qvel[-1], before, atol=1e-9)


def test_integrating_the_velocity_moves_to_the_next_frame(smooth_qpos):
    qpos = smooth_qpos(fps=1000.0)
    qvel = generalized_velocities(qpos, 1000.0)
    for t in (5, 20):
        q = qpos[t].copy()
        mujoco.mj_integratePos(G1.model, q, qvel[t], 1e-3)
        np.testing.assert_allclose(q, qpos[t + 1], atol=5e-6)


def test_quaternion_signs_do_not_matter(smooth_qpos):
    qpos = smooth_qpos()
    flipped = qpos.copy()
    flipped[::3, 3:7] *= -1
    np.testing.assert_allclose(
        generalized_velocities(flipped, FPS), generalized_velocities(qpos, FPS), atol=1e-12
    )


def test_one_frame_stands_still(smooth_qpos):
    assert not generalized_velocities(smooth_qpos(1), FPS).any()


def test_body_velocities_are_those_of_the_simulator(smooth_qpos):
    reference = reference_from_qpos(G1, FPS, smooth_qpos())
    data = mujoco.MjData(G1.model)
    velocity = np.empty(6)
    xbody = mujoco.mjtObj.mjOBJ_XBODY
    for t in range(0, reference.num_frames, 5):
        data.qpos[:], data.qvel[:] = reference.qpos[t], reference.qvel[t]
        mujoco.mj_forward(G1.model, data)
        np.testing.assert_allclose(reference.body_positions[t], data.xpos[1:], atol=1e-12)
        for i, name in enumerate(reference.body_names):
            body = G1.model.body(name).id
            mujoco.mj_objectVelocity(G1.model, data, xbody, body, velocity, 0)
            np.testing.assert_allclose(
                reference.body_angular_velocities[t, i], velocity[:3], atol=1e-10
            )
            np.testing.assert_allclose(
                reference.body_linear_velocities[t, i], velocity[3:], atol=1e-10
            )


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_body_velocities_are_the_differences_of_the_poses(yaw, smooth_qpos):
    fps = 1000.0
    reference = reference_from_qpos(G1, fps, smooth_qpos(60, fps, yaw))
    linear = differences(reference.body_positions, fps)
    np.testing.assert_allclose(reference.body_linear_velocities[1:-1], linear, atol=2e-4)
    turn = rotations.difference(reference.body_quaternions[:-2], reference.body_quaternions[2:]) * (
        0.5 * fps
    )
    world = rotations.rotate(reference.body_quaternions[1:-1], turn)
    np.testing.assert_allclose(reference.body_angular_velocities[1:-1], world, atol=2e-4)


@pytest.mark.parametrize("yaw", [0.7, np.pi / 2, np.pi])
def test_a_turned_motion_has_the_same_velocities_in_its_body_frames(yaw, smooth_qpos):
    # A root angular velocity written in the world frame passes for a robot that faces +x only.
    plain = reference_from_qpos(G1, FPS, smooth_qpos())
    turned = reference_from_qpos(G1, FPS, smooth_qpos(yaw=yaw))
    np.testing.assert_allclose(turned.qvel[:, 3:], plain.qvel[:, 3:], atol=1e-9)
    for field in ("body_linear_velocities", "body_angular_velocities"):
        in_body = [
            rotations.rotate(rotations.conjugate(r.body_quaternions), getattr(r, field))
            for r in (plain, turned)
        ]
        np.testing.assert_allclose(in_body[1], in_body[0], atol=1e-9)


def test_object_velocities_are_in_the_world(smooth_object):
    fps = 1000.0
    poses = smooth_object(60, fps)
    velocities = pose_velocities(poses, fps)
    np.testing.assert_allclose(velocities[1:-1, :3], differences(poses[:, :3], fps), atol=1e-9)
    # dq/dt = ½ ω_world q
    omega = np.concatenate([np.zeros((58, 1)), velocities[1:-1, 3:]], axis=1)
    rate = 0.5 * rotations.multiply(omega, poses[1:-1, 3:])
    np.testing.assert_allclose(rate, differences(poses[:, 3:], fps), atol=1e-5)


def test_object_velocities_put_into_a_free_joint_move_the_object_along(
    box_scene, smooth_qpos, smooth_object
):
    poses = smooth_object()
    reference = reference_from_qpos(G1, FPS, smooth_qpos(), poses, box_scene)
    t = 10
    angular_body = rotations.rotate(
        rotations.conjugate(poses[t, 3:]), reference.object_velocities[t, 3:]
    )
    q = rotations.multiply(poses[t, 3:], rotations.exp(angular_body / FPS))
    np.testing.assert_allclose(q, poses[t + 1, 3:], atol=1e-3)


@pytest.mark.parametrize(
    ("qpos", "field"),
    [
        (np.zeros((5, 12)), "qpos"),
        (np.zeros((0, 36)), "qpos"),
        (np.full((5, 36), np.nan), "qpos"),
    ],
)
def test_bad_motions_are_refused(qpos, field):
    with pytest.raises(InvalidDataError, match=field):
        reference_from_qpos(G1, FPS, qpos)


@pytest.mark.parametrize("fps", [0.0, -30.0, np.nan])
def test_bad_rates_are_refused(fps, smooth_qpos):
    with pytest.raises(InvalidDataError, match="fps"):
        reference_from_qpos(G1, fps, smooth_qpos())


def test_object_poses_need_an_object(smooth_qpos, smooth_object):
    with pytest.raises(InvalidDataError, match="object_poses"):
        reference_from_qpos(G1, FPS, smooth_qpos(), smooth_object())
