"""Joint, speed, contact and stance limits: what they bound is what the robot then does."""

import numpy as np
import pytest

from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.joint_limits import JointLimit, StepVelocityLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, FOOTING, SELF, STANCE
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.restoration import row_violations
from omni_envs.retargeting.stance_limit import StanceLimit
from omni_envs.retargeting.stance_plan import ANCHORED, FREE, LIFT, FootWishes, plan_stance
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


def test_the_nearest_configuration_within_the_speed_limit(configuration):
    limit, goal = StepVelocityLimit(G1, 30.0, 1.0), G1.default_qpos.copy()
    goal[7] += 2.0
    goal[8] += 1e-3
    assert limit.nearest(configuration, goal) is goal
    limit.set_previous(G1.default_qpos)
    q = limit.nearest(configuration, goal)
    np.testing.assert_allclose(q[7] - G1.default_qpos[7], G1.velocity_limits[0] / 30, rtol=1e-5)
    np.testing.assert_allclose(q[8:], goal[8:], atol=1e-12)


def test_without_limit_on_depth_only_the_robot_itself_is_kept_apart(configuration):
    q = G1.default_qpos.copy()
    q[2] -= 0.1
    configuration.update(q)
    assert row_violations(ContactLimit(0.0).rows(configuration))[2] > 0.05
    assert row_violations(ContactLimit(np.inf).rows(configuration))[2] == 0.0


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


def stand(configuration, frames=6, pivots=False, rise=0.0, slope=0.0, reach=0.0):
    feet = configuration.feet()[:, :, :2]
    wishes = FootWishes(
        np.repeat(feet[None, :, 0], frames, axis=0),
        np.zeros((frames, 2)),
        feet[None, :, 1, 0] + np.linspace(0.0, reach, frames)[:, None],
        np.ones((frames, 2)),
        np.full(2, 0.1),
    )
    options = StanceOptions()
    tier = np.full((frames, 2), ANCHORED)
    axes = np.array([[np.cos(slope), 0.0, np.sin(slope)], [0.0, 1.0, 0.0]])
    human = HumanFeet(
        np.full((frames, 2), pivots),
        np.full((frames, 2), rise),
        np.tile(axes, (frames, 2, 1, 1)),
        np.full((frames, 2), np.inf),
        np.zeros((frames, 2), bool),
    )
    return StanceLimit(plan_stance(tier, wishes, 0.03, human, 30.0, options), options)


def violation_after(limit, configuration, **moved):
    """Largest violation on frame 1 after a move of root coordinates since frame 0."""
    limit.hold(0)
    limit.record(configuration, 0)
    q = G1.default_qpos.copy()
    for axis, way in moved.items():
        q["xyz".index(axis)] += way
    configuration.update(q)
    limit.hold(1)
    rows = limit.rows(configuration)
    return float(np.maximum(rows.lower, -rows.upper).max())


def test_a_standing_foot_may_come_down_but_not_float_away(configuration):
    assert violation_after(stand(configuration), configuration, z=-0.02) <= 1e-9
    configuration.update(G1.default_qpos)
    up = violation_after(stand(configuration), configuration, z=0.02)
    assert up == pytest.approx(0.02 - LIFT, abs=1e-6)
    configuration.update(G1.default_qpos)
    assert violation_after(stand(configuration, rise=0.03), configuration, z=0.02) <= 1e-9


def test_on_a_slope_a_foot_is_held_along_the_slope(configuration):
    slope = 0.2
    away = {"x": -0.01 * np.sin(slope), "z": 0.01 * np.cos(slope)}
    limit = stand(configuration, rise=0.03, slope=slope)
    assert violation_after(limit, configuration, **away) <= 1e-9
    configuration.update(G1.default_qpos)
    along = {"x": 0.01 * np.cos(slope), "z": 0.01 * np.sin(slope)}
    limit = stand(configuration, rise=0.03, slope=slope)
    assert violation_after(limit, configuration, **along) == pytest.approx(9.9e-3, abs=1e-6)


def test_a_foot_rolls_only_while_the_human_does(configuration):
    """Four rows more hold hearts than headings, of both feet."""
    for pivots, rows in ((False, 10), (True, 8)):
        limit = stand(configuration, pivots=pivots, reach=0.05)
        limit.hold(0)
        limit.record(configuration, 0)
        limit.hold(1)
        assert len(limit.rows(configuration).lower) == rows


def test_the_way_to_a_foothold_is_no_constraint(configuration):
    options, frames = StanceOptions(), 6
    tips = np.repeat(configuration.feet()[None, :, 0, :2], frames, axis=0) + 0.02
    flat = np.zeros((frames, 2))
    wishes = FootWishes(tips, flat, flat - 0.1, flat + 1.0, np.full(2, 0.1))
    axes = np.tile(np.eye(3)[:2], (frames, 2, 1, 1))
    human = HumanFeet(flat > 0, flat, axes, flat + np.inf, flat > 0)
    tier = np.full((frames, 2), ANCHORED)
    tier[:3] = FREE
    limit = StanceLimit(plan_stance(tier, wishes, 0.03, human, 30.0, options), options)
    for t in range(3):
        limit.hold(t)
        limit.record(configuration, t)
    limit.hold(3)
    rows = limit.rows(configuration)
    assert (rows.kind == FOOTING).all() and np.maximum(rows.lower, -rows.upper).max() > 1e-3
    assert row_violations(rows) == (0.0, 0.0, 0.0)


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
        assert set(rows.kind) == {STANCE, FOOTING}
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
    assert np.isclose(moved, 1e-3).sum() == 2 and np.isclose(moved, 0.0, atol=1e-9).sum() == 8
