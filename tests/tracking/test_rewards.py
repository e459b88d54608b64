import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.tracking import rewards
from omni_envs.tracking.alignment import Bodies, align

N, B = 6, 4


def quaternions(count, seed):
    return Rotation.random(count, random_state=seed).as_quat(scalar_first=True)


@pytest.fixture
def scene():
    rng = np.random.default_rng(0)

    def bodies(seed):
        return Bodies(
            rng.normal(size=(N, B, 3)),
            quaternions(N * B, seed).reshape(N, B, 4),
            rng.normal(size=(N, B, 3)),
            rng.normal(size=(N, B, 3)),
        )

    poses = [np.concatenate([rng.normal(size=(N, 3)), quaternions(N, s)], 1) for s in (7, 8)]
    return bodies(1), bodies(2), *poses


def errors(robot, reference, pose, reference_pose):
    a = align(
        robot.position[:, 1],
        robot.quaternion[:, 1],
        reference.position[:, 1],
        reference.quaternion[:, 1],
    )
    return rewards.tracking_errors(robot, reference, a, 1, pose, reference_pose)


def test_each_error_is_what_its_name_says(scene):
    robot, reference, pose, reference_pose = scene
    e = errors(*scene)
    assert tuple(e._fields) == rewards.TRACKING_TERMS
    np.testing.assert_allclose(
        e.anchor_position, np.sum((robot.position[:, 1] - reference.position[:, 1]) ** 2, -1)
    )
    for name, a, b in (
        ("body_linear_velocity", robot.linear_velocity, reference.linear_velocity),
        ("body_angular_velocity", robot.angular_velocity, reference.angular_velocity),
    ):
        np.testing.assert_allclose(getattr(e, name), np.mean(np.sum((a - b) ** 2, -1), -1))
    np.testing.assert_allclose(
        e.object_position, np.sum((pose[:, :3] - reference_pose[:, :3]) ** 2, -1)
    )
    turns = [Rotation.from_quat(p[:, 3:], scalar_first=True) for p in (pose, reference_pose)]
    np.testing.assert_allclose(
        e.object_orientation, (turns[0] * turns[1].inv()).magnitude() ** 2, atol=1e-6
    )


def test_mean_over_bodies_is_taken_before_the_exponential():
    a, b = np.zeros((1, 2, 3)), np.zeros((1, 2, 3))
    b[0, 0, 0] = 0.6
    value = rewards.tracking_reward(rewards.mean_squared_distance(a, b), 0.3)
    assert value[0] == pytest.approx(np.exp(-(0.36 / 2) / 0.09))


def test_tracking_reward_of_a_match_is_one():
    assert rewards.tracking_reward(np.zeros(3), 0.3) == pytest.approx([1, 1, 1])
    assert rewards.tracking_reward(np.array([0.09]), 0.3) == pytest.approx([np.exp(-1)])


def test_bodies_left_out_of_the_orientation_do_not_count(scene):
    robot, reference, *_ = scene
    a = align(
        robot.position[:, 0],
        robot.quaternion[:, 0],
        reference.position[:, 0],
        reference.quaternion[:, 0],
    )
    kept = np.array([0, 2])
    part = rewards.tracking_errors(robot, reference, a, 0, orientation_bodies=kept)
    full = a.angle(robot.quaternion, reference.quaternion)
    np.testing.assert_allclose(part.body_orientation, np.mean(full[:, kept] ** 2, axis=1))
    assert part.object_position is None


def test_penalties():
    assert rewards.action_rate(np.ones((1, 3)), -np.ones((1, 3))) == pytest.approx([12])
    low, high = np.array([-1.0, -1.0]), np.array([1.0, 2.0])
    excess = rewards.joint_limit_excess(np.array([[1.5, -1.25], [0.0, 2.0]]), low, high)
    assert excess == pytest.approx([0.75, 0.0])


def test_contact_counts():
    force = np.zeros((2, 3, 4, 3))
    force[0, 1, 2] = [0.8, 0.8, 0.0]  # 1.13 N
    force[0, 1, 3] = [0.0, 0.0, -5.0]  # same body, another substep
    force[0, 2, 3] = [0.0, 2.0, 0.0]
    force[1, 0, 0] = [0.5, 0.5, 0.5]  # 0.87 N: too weak
    assert rewards.bodies_in_contact(force, 1.0).tolist() == [2, 0]
    assert rewards.substeps_in_contact(force, 1.0).tolist() == [2, 0]


def test_numpy_and_torch_agree(scene):
    torch = pytest.importorskip("torch")

    def tensors(x):
        return Bodies(*map(torch.as_tensor, x)) if isinstance(x, Bodies) else torch.as_tensor(x)

    ours, theirs = errors(*scene), errors(*map(tensors, scene))
    for name, a, b in zip(ours._fields, ours, theirs, strict=True):
        assert isinstance(b, torch.Tensor)
        np.testing.assert_allclose(b.numpy(), a, rtol=1e-9, atol=1e-12, err_msg=name)
        value = rewards.tracking_reward(b, 0.4).numpy()
        np.testing.assert_allclose(value, rewards.tracking_reward(a, 0.4), rtol=1e-9)
    force = np.random.default_rng(0).normal(size=(5, 3, 4, 3))
    for count in (rewards.bodies_in_contact, rewards.substeps_in_contact):
        assert count(torch.as_tensor(force), 1.5).tolist() == count(force, 1.5).tolist()
    q, low, high = force[:, :, 0, 0], -0.3 * np.ones(3), 0.3 * np.ones(3)
    np.testing.assert_allclose(
        rewards.joint_limit_excess(*map(torch.as_tensor, (q, low, high))).numpy(),
        rewards.joint_limit_excess(q, low, high),
    )
    np.testing.assert_allclose(
        rewards.action_rate(torch.as_tensor(q), torch.as_tensor(2 * q)).numpy(),
        rewards.action_rate(q, 2 * q),
    )
