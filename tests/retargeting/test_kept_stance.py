import numpy as np
import pytest

from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.kept_stance import (
    HEART,
    TIP,
    KeptStance,
    foot_points,
    stance_windows,
)
from omni_envs.retargeting.kinematics import Kinematics, Points
from omni_envs.retargeting.limits import FOOTING, STANCE
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import ANCHORED, FREE, LOOSE
from omni_envs.robots import G1
from omni_envs.scenes import Scene

FPS, OPTIONS = 30.0, StanceOptions()


def standing(frames=10):
    """(T, 2, 2, 3) feet side by side, heading 30° to the left."""
    forward = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    feet = np.zeros((frames, 2, 2, 3))
    feet[:, 1] += np.array([0.1, -0.2, 0.0])
    feet[:, :, HEART] -= 0.1 * forward
    return feet


def tiers(frames=10, *runs):
    """(T, 2) anchored, but for (tier, start, stop) of both feet."""
    out = np.full((frames, 2), ANCHORED)
    for tier, start, stop in runs:
        out[start:stop] = tier
    return out


def human(frames=10, pivots=slice(0, 0), slope=0.0):
    flags = np.zeros((frames, 2), bool)
    flags[pivots] = True
    axes = np.array([[np.cos(slope), 0.0, np.sin(slope)], [0.0, 1.0, 0.0]])
    axes = np.tile(axes, (frames, 2, 1, 1))
    on_ground = np.zeros((frames, 2))
    return HumanFeet(flags, on_ground, axes, on_ground, on_ground > 0)


def inside(windows, feet, t):
    """(2, 2, 2) whether the places lie in their windows."""
    offset = (windows.axes[t][:, None] @ feet[t, ..., None])[..., 0] - windows.centre[t]
    return np.abs(offset) <= windows.slack[t] + 1e-12


def test_windows_contain_the_motion_and_are_along_the_foot():
    feet = standing()
    windows = stance_windows(feet, tiers(), human(), FPS, OPTIONS)
    assert all(inside(windows, feet, t).all() for t in range(10))
    assert windows.slack[5, 0, TIP].max() <= OPTIONS.tolerance
    np.testing.assert_allclose(windows.axes[5, 0, 0], [np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    gram = windows.axes[5] @ windows.axes[5].transpose(0, 2, 1)
    np.testing.assert_allclose(gram, np.broadcast_to(np.eye(2), (2, 2, 2)), atol=1e-12)


def test_where_the_foot_rolled_it_may_roll():
    feet = standing()
    feet[5:, 0, HEART, :2] += 0.02
    windows = stance_windows(feet, tiers(), human(), FPS, OPTIONS)
    assert windows.slack[7, 0, HEART].max() >= 0.01
    assert windows.slack[7, 1, HEART].max() <= OPTIONS.tolerance


def test_a_foot_that_rolled_with_the_human_is_still_before_and_after():
    feet = standing()
    feet[4:7, 0, HEART, :2] += [[0.005], [0.01], [0.015]]
    feet[7:, 0, HEART, :2] += 0.02
    windows = stance_windows(feet, tiers(), human(pivots=slice(4, 7)), FPS, OPTIONS)
    assert all(inside(windows, feet, t).all() for t in range(10))
    assert windows.slack[[2, 8], 0, HEART].max() <= OPTIONS.tolerance
    assert windows.slack[5, 0, HEART].max() > OPTIONS.tolerance


def test_a_heel_that_comes_down_lets_the_foot_roll_though_it_hardly_moves_from_above():
    feet = standing()
    feet[:4, 0, HEART, 2] += 0.03
    feet[4:, 0, HEART, :2] += [0.003, 0.0]
    windows = stance_windows(feet, tiers(), human(pivots=slice(3, 6)), FPS, OPTIONS)
    assert all(inside(windows, feet, t).all() for t in (0, 2, 7, 9))
    assert windows.slack[[2, 8], 0, HEART].max() <= OPTIONS.tolerance
    assert windows.slack[4, 0, HEART].max() > OPTIONS.tolerance


def test_on_a_slope_windows_lie_in_the_slope():
    feet, normal = standing(), np.array([-np.sin(0.3), 0.0, np.cos(0.3)])
    windows = stance_windows(feet, tiers(), human(slope=0.3), FPS, OPTIONS)
    np.testing.assert_allclose(windows.axes @ normal, 0.0, atol=1e-12)
    assert all(inside(windows, feet + 0.02 * normal, t).all() for t in range(10))


def test_heart_drifts_no_further_than_it_did():
    feet = standing()
    angles = np.linspace(0, np.pi, 10)
    feet[:, :, HEART, 0] += 1e-3 * np.sin(angles)[:, None]
    feet[:, :, HEART, 1] += 8e-4 * np.sin(2 * angles)[:, None]
    windows = stance_windows(feet, tiers(), human(), FPS, OPTIONS)
    moved = feet[:, 0, HEART, :2] - feet[0, 0, HEART, :2]
    centre, slack = windows.centre[5, 0, HEART], windows.slack[5, 0, HEART]
    start = windows.axes[5, 0] @ feet[0, 0, HEART]
    corner = np.linalg.norm(np.abs(centre - start) + slack)
    assert corner <= np.linalg.norm(moved, axis=1).max() + 1e-9


def test_forced_steps_stay_on_their_frames():
    feet = standing()
    feet[6:, 0, :, 0] += 0.03
    windows = stance_windows(feet, tiers(), human(), FPS, OPTIONS)
    assert all(inside(windows, feet, t).all() for t in range(10))
    assert windows.slack[:, 0, TIP].max() <= OPTIONS.tolerance
    jump = np.linalg.norm(windows.centre[6, 0, TIP] - windows.centre[5, 0, TIP])
    assert jump == pytest.approx(0.03)


def test_steps_of_free_loose_and_anchored_tips():
    windows = stance_windows(
        standing(), tiers(10, (FREE, 0, 3), (LOOSE, 3, 6)), human(), FPS, OPTIONS
    )
    slow = OPTIONS.loose_speed / FPS / np.sqrt(2.0)
    assert np.isinf(windows.steps[:4]).all()  # the first loose frame comes from a free one
    np.testing.assert_allclose(windows.steps[4:7, :, :2], slow)  # up to the frame of landing
    assert np.isinf(windows.steps[7:, :, :2]).all()
    assert np.isfinite(windows.steps[4:, :, 2]).all()


@pytest.fixture(scope="module")
def robot():
    kinematics = Kinematics(G1, Scene())
    return kinematics, Points(kinematics.model, *foot_points(G1))


def feet_of(kinematics, points, qpos):
    feet = []
    for q in qpos:
        kinematics.update(q)
        feet.append(kinematics.positions(points).reshape(2, 2, 3))
    return np.array(feet)


def test_rows_are_the_derivatives_of_the_windows(robot):
    kinematics, points = robot
    qpos = np.tile(G1.default_qpos, (3, 1))
    feet = feet_of(kinematics, points, qpos)
    mixed = np.full((3, 2), LOOSE)
    mixed[:, 0] = ANCHORED
    limit = KeptStance(stance_windows(feet, mixed, human(3), FPS, OPTIONS), kinematics)
    for t in range(2):
        limit.hold(t)
        kinematics.update(qpos[t])
        limit.record(kinematics)
    limit.hold(2)
    rows = limit.rows(kinematics)
    # Tip and heart, rise and height of the anchored; steps of the loose, and where it goes.
    assert len(rows.lower) == 4 + 2 + 3 + 3 and (rows.kind == FOOTING).sum() == 3
    dq = 1e-6 * np.random.default_rng(0).normal(size=G1.nv)
    kinematics.update(kinematics.step(dq))
    after = limit.rows(kinematics)
    bound = rows.kind == STANCE
    assert np.isinf(rows.lower[bound]).sum() == 1  # a tip may always come down
    for before, then in ((rows.upper, after.upper), (rows.lower, after.lower)):
        finite = np.isfinite(before)
        assert (finite <= bound).all()
        change = before[finite] - then[finite]
        np.testing.assert_allclose(change, (rows.A @ dq)[finite], atol=1e-10)


def test_a_landing_beside_the_window_moves_the_stance(robot):
    kinematics, points = robot
    qpos = np.tile(G1.default_qpos, (4, 1))
    feet = feet_of(kinematics, points, qpos)
    windows = stance_windows(feet, tiers(4, (FREE, 0, 1)), human(4), FPS, OPTIONS)
    limit = KeptStance(windows, kinematics)
    beside = qpos[1].copy()
    beside[0] += 3e-4
    worst = {}
    for t, q in enumerate([qpos[0], beside, beside, qpos[3]]):
        limit.hold(t)
        kinematics.update(q)
        rows = limit.rows(kinematics)
        misses = None if rows is None else np.maximum(rows.lower, -rows.upper)
        worst[t] = None if rows is None else misses[rows.kind == STANCE].max()
        if t == 1:  # aimed at, but no constraint
            assert misses[rows.kind == FOOTING].max() > 1e-4
        limit.record(kinematics)
    assert worst[0] is None and worst[1] <= 0.0 and worst[2] <= 1e-12
    assert worst[3] > 1e-4  # and from there it may not come back


def test_a_lifted_foot_may_come_down_at_once_but_not_rise(robot):
    kinematics, points = robot
    qpos = np.tile(G1.default_qpos, (3, 1))
    windows = stance_windows(feet_of(kinematics, points, qpos), tiers(3), human(3), FPS, OPTIONS)
    lifted, higher = qpos[1].copy(), qpos[1].copy()
    lifted[2] += 0.02
    higher[2] += 0.03
    for last, allowed in ((qpos[2], True), (higher, False)):
        limit = KeptStance(windows, kinematics)
        for t, q in enumerate((qpos[0], lifted)):
            limit.hold(t)
            kinematics.update(q)
            limit.record(kinematics)
        limit.hold(2)
        kinematics.update(last)
        rows = limit.rows(kinematics)
        assert (np.maximum(rows.lower, -rows.upper).max() <= 1e-9) == allowed
