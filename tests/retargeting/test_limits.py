"""Joint, speed, contact and stance limits: what they bound is what the robot then does."""

import numpy as np
import pytest

from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.joint_limits import JointLimit, StepVelocityLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, SELF, STANCE
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_limit import StanceLimit
from omni_envs.retargeting.stance_plan import ANCHORED, FootWishes, plan_stance
from omni_envs.robots import G1
from omni_envs.scenes import Scene


@pytest.fixture
def configuration():
    configuration = Kinematics(G1, Scene())
    configuration.update(G1.default_qpos)
    return configuration


def test_joint_limit_ends_at_the_limit(configuration):
    lower, upper = JointLimit(G1).bounds(configuration)
    low, high = G1.reference_joint_ranges.T
    np.testing.assert_allclose(G1.default_qpos[7:] + lower[6:], low)
    np.testing.assert_allclose(G1.default_qpos[7:] + upper[6:], high)
    assert np.isinf(lower[:6]).all()


def test_speed_is_counted_from_the_previous_frame_not_the_iterate(configuration):
    limit = StepVelocityLimit(G1, 30.0, 1.0)
    limit.set_previous(G1.default_qpos)
    q = G1.default_qpos.copy()
    q[7:] += 0.1
    configuration.update(q)
    lower, upper = limit.bounds(configuration)
    np.testing.assert_allclose(upper[6:], G1.velocity_limits / 30 - 0.1, atol=1e-5)
    np.testing.assert_allclose(lower[6:], -G1.velocity_limits / 30 - 0.1, atol=1e-5)
    limit.set_previous(None)
    assert np.isinf(limit.bounds(configuration)[1]).all()


def test_contact_rows_predict_distances(configuration):
    limit, rng = ContactLimit(0.0), np.random.default_rng(0)
    q = G1.default_qpos.copy()
    q[2] -= 0.004
    configuration.update(q)
    rows = limit.rows(configuration)
    ground = rows.kind == CONTACT
    assert ground.sum() >= 8 and rows.lower[ground].max() == pytest.approx(0.004, abs=2e-3)
    dq = 1e-4 * rng.normal(size=35)
    configuration.update(configuration.step(dq))
    after = limit.rows(configuration)
    if len(after.lower) == len(rows.lower):
        np.testing.assert_allclose(after.lower, rows.lower - rows.A @ dq, atol=5e-6)


def test_self_contact_is_told_apart(configuration):
    q = G1.default_qpos.copy()
    q[7 + G1.joint_names.index("left_hip_roll_joint")] = -0.2
    q[7 + G1.joint_names.index("right_hip_roll_joint")] = 0.2
    configuration.update(q)
    rows = ContactLimit(0.0).rows(configuration)
    assert (rows.kind == SELF).any()
    # Moving the whole robot changes no distance between its own parts.
    np.testing.assert_allclose(rows.A[rows.kind == SELF][:, :3], 0.0, atol=1e-9)


def test_without_self_distance_only_surroundings_touch():
    configuration = Kinematics(G1, Scene(), self_distance=None)
    q = G1.default_qpos.copy()
    q[7 + G1.joint_names.index("left_hip_roll_joint")] = -0.4
    q[7 + G1.joint_names.index("right_hip_roll_joint")] = 0.4
    configuration.update(q)
    rows = ContactLimit(0.0).rows(configuration)
    assert (rows.kind == CONTACT).all()


def stand(configuration, frames=6):
    feet = configuration.feet()[:, :, :2]
    wishes = FootWishes(
        np.repeat(feet[None, :, 0], frames, axis=0),
        np.zeros((frames, 2)),
        np.repeat(feet[None, :, 1, 0], frames, axis=0),
        np.ones((frames, 2)),
    )
    options = StanceOptions()
    tier = np.full((frames, 2), ANCHORED)
    return StanceLimit(plan_stance(tier, wishes, 30.0, options), options)


def test_anchored_foot_keeps_its_absolute_place(configuration):
    limit = stand(configuration)
    limit.hold(0)
    limit.record(configuration, 0)
    q = G1.default_qpos.copy()
    for t in range(1, 6):
        q[0] += 5e-5  # creeping by less than the tolerance per frame
        configuration.update(q)
        limit.hold(t)
        rows = limit.rows(configuration)
        assert (rows.kind == STANCE).all()
        limit.record(configuration, t)
    violation = np.maximum(rows.lower, -rows.upper).max()
    assert violation == pytest.approx(1.5e-4, abs=2e-5)


def test_feet_of_rows_are_feet_of_the_robot(configuration):
    limit = stand(configuration)
    limit.hold(0)
    limit.record(configuration, 0)
    limit.hold(1)
    rows = limit.rows(configuration)
    dq = np.zeros(35)
    dq[0] = 1e-3
    # Tips move with the root, the arms from there to the hearts do not.
    moved = rows.A @ dq
    assert np.isclose(moved, 1e-3).sum() == 2 and np.isclose(moved, 0.0, atol=1e-9).sum() == 6
