import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.robots import G1
from omni_envs.tracking.config import PushConfig, ResetNoise
from omni_envs.tracking.randomization import push, scaled_inertia, start_state

COUNT = 4000


def rotation(q):
    return Rotation.from_quat(q, scalar_first=True)


@pytest.fixture(scope="module")
def started():
    rng = np.random.default_rng(0)
    qpos, qvel = np.zeros((COUNT, 43)), rng.normal(size=(COUNT, 41))
    qpos[:, :36] = G1.default_qpos
    qpos[:, 3:7] = Rotation.random(COUNT, random_state=1).as_quat(scalar_first=True)
    qpos[:, 36:43] = [1, 0, 0.2, 1, 0, 0, 0]
    low, high = G1.joint_ranges.T
    disturbed = start_state(qpos, qvel, ResetNoise(), low, high, np.random.default_rng(4))
    return qpos, qvel, *disturbed


def uniform(values, half_widths):
    """Whether every column is uniform on ± its half width."""
    values, half = np.atleast_2d(values.T).T, np.asarray(half_widths, float)
    assert (np.abs(values) <= half + 1e-9).all()
    for column, h in zip(values.T, np.broadcast_to(half, values.shape[1]), strict=True):
        if h == 0:
            assert not column.any()
            continue
        quantiles = np.quantile(column, [0.1, 0.5, 0.9]) / h
        np.testing.assert_allclose(quantiles, [-0.8, 0.0, 0.8], atol=0.06)


def test_root_position_and_velocity(started):
    qpos, qvel, new, velocity = started
    uniform(new[:, :3] - qpos[:, :3], (0.05, 0.05, 0.01))
    uniform(velocity[:, :3] - qvel[:, :3], (0.5, 0.5, 0.2))


def test_root_turns_about_the_world_axes(started):
    qpos, _, new, _ = started
    turn = rotation(new[:, 3:7]) * rotation(qpos[:, 3:7]).inv()
    uniform(turn.as_euler("xyz"), (0.1, 0.1, 0.2))


def test_spin_is_disturbed_in_the_world(started):
    qpos, qvel, new, velocity = started
    before = rotation(qpos[:, 3:7]).apply(qvel[:, 3:6])
    after = rotation(new[:, 3:7]).apply(velocity[:, 3:6])
    uniform(after - before, (0.52, 0.52, 0.78))


def test_joints_and_object(started):
    qpos, qvel, new, velocity = started
    uniform(new[:, 7:36] - qpos[:, 7:36], 0.1)
    uniform(new[:, 36:39] - qpos[:, 36:39], (0.05, 0.05, 0.0))
    np.testing.assert_array_equal(new[:, 39:], qpos[:, 39:])
    np.testing.assert_array_equal(velocity[:, 6:], qvel[:, 6:])


def test_joints_are_clipped_to_soft_limits():
    qpos, qvel = np.tile(G1.default_qpos, (200, 1)), np.zeros((200, 35))
    low, high = G1.default_joint_array - 0.02, G1.default_joint_array + 0.03
    new, _ = start_state(qpos, qvel, ResetNoise(), low, high, np.random.default_rng(0))
    assert new.shape == (200, 36)
    assert (new[:, 7:] >= low).all()
    assert (new[:, 7:] <= high).all()
    assert (new[:, 7:] == low).any()


def test_no_noise_is_no_change():
    qpos, qvel = np.tile(G1.default_qpos, (3, 1)), np.ones((3, 35))
    new, velocity = start_state(qpos, qvel, None, -1, 1, np.random.default_rng(0))
    np.testing.assert_array_equal(new, qpos)
    np.testing.assert_array_equal(velocity, qvel)
    assert new is not qpos


def test_push_is_drawn_about_the_worlds_axes():
    q = Rotation.random(COUNT, random_state=3).as_quat(scalar_first=True)
    config = PushConfig(linear=(0.5, 0.4, 0.2), angular=(0.52, 0.52, 0.78))
    drawn = push(q, config, np.random.default_rng(0))
    uniform(drawn[:, :3], (0.5, 0.4, 0.2))
    uniform(rotation(q).apply(drawn[:, 3:]), (0.52, 0.52, 0.78))


def test_stretched_box_inertia():
    h, s, mass = np.array([0.2, 0.3, 0.1]), np.array([1.1, 0.9, 1.05]), 2.0

    def box(h):
        return np.diag(
            mass
            / 3
            * np.array([h[1] ** 2 + h[2] ** 2, h[0] ** 2 + h[2] ** 2, h[0] ** 2 + h[1] ** 2])
        )

    np.testing.assert_allclose(scaled_inertia(box(h), s), box(h * s), atol=1e-15)


def test_start_states_can_get_a_share_of_the_noise():
    qpos, qvel = np.tile(np.r_[G1.default_qpos, 1, 0, 0.2, 1, 0, 0, 0], (3, 1)), np.zeros((3, 41))
    low, high = G1.joint_ranges.T

    def disturbed(share):
        rng = np.random.default_rng(4)
        return start_state(qpos, qvel, ResetNoise(), low, high, rng, share)

    none, half, whole = disturbed(np.array([0.0, 0.5, 1.0]))[0] - qpos
    without = disturbed(None)[0] - qpos
    assert not none.any()
    np.testing.assert_allclose(half[:3], 0.5 * without[1, :3])
    np.testing.assert_array_equal(whole, without[2])
