from dataclasses import replace

import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.retargeting import RetargetOptions, refine, retarget
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.nominal_task import nominal_weights
from omni_envs.robots import G1, get_robot

SHIFT = np.array([0.0, 0.15, 0.0])
STRONG = RetargetOptions(nominal_weight=200.0)


@pytest.fixture(scope="module")
def start(box_carry, cut):
    """Standing before the box, and touching it."""
    first = int(np.flatnonzero(box_carry.contacts["left_hand"])[0])
    return cut(box_carry, first - 30, first + 30)


@pytest.fixture(scope="module")
def nominal(start):
    return retarget(start, G1)


@pytest.fixture(scope="module")
def aside(start):
    """The same with the box further to the side."""
    poses = start.object_poses.copy()
    poses[:, :3] += SHIFT
    return replace(start, object_poses=poses)


@pytest.fixture(scope="module")
def free(aside):
    return retarget(aside, G1)


@pytest.fixture(scope="module")
def anchored(aside, nominal):
    return retarget(aside, G1, STRONG, nominal=nominal)


def tips(motion, t):
    configuration = Kinematics(G1, motion.source.scene)
    configuration.update(motion.qpos[t])
    return configuration.feet()[:, 0, :2]


def test_only_base_and_legs_are_anchored_and_let_go():
    for name, legs in (("g1", 12), ("t1", 13), ("h1", 10)):
        robot = get_robot(name)
        weights = nominal_weights(_kinematics(robot), RetargetOptions(), 31, 30.0)
        moved = [robot.joint_names[i].lower() for i in np.flatnonzero(weights[0, 6:])]
        assert len(moved) == legs
        # The T1's waist lies between its root, the trunk, and its feet.
        assert all(any(part in j for part in ("hip", "knee", "ank", "waist")) for j in moved)
        np.testing.assert_allclose(weights[0, :6], [5, 5, 5, 1.25, 1.25, 1.25])
        np.testing.assert_allclose(weights[10], weights[0] / np.e)
        kept = nominal_weights(_kinematics(robot), RetargetOptions(nominal_decay=None), 31, 30.0)
        np.testing.assert_array_equal(kept[30], weights[0])


def _kinematics(robot):
    from omni_envs.scenes import Scene

    return Kinematics(robot, Scene())


def test_it_starts_where_the_nominal_motion_does(nominal, free, anchored):
    # Without it, the robot follows the box.
    assert np.linalg.norm(free.qpos[0, :3] - nominal.qpos[0, :3] - SHIFT) < 0.05
    assert np.linalg.norm(anchored.qpos[0, :3] - nominal.qpos[0, :3]) < 0.05
    np.testing.assert_allclose(tips(anchored, 0), tips(nominal, 0), atol=2e-3)


def test_it_lets_go_with_time(nominal, anchored):
    away = np.linalg.norm(anchored.qpos[:, :3] - nominal.qpos[:, :3], axis=1)
    assert away[-1] > away[0] + 0.05


def test_without_decay_it_holds_on(aside, nominal, anchored):
    kept = retarget(aside, G1, replace(STRONG, nominal_decay=None), nominal=nominal.qpos)
    far, near = (np.linalg.norm(m.qpos[-1, :3] - nominal.qpos[-1, :3]) for m in (anchored, kept))
    assert near < 0.6 * far


def test_published_weight_moves_the_start_as_published(shared, largebox, cut):
    runs = [
        np.load(shared / f"anchors/official_runs/sub3_largebox_003_{n}.npz", allow_pickle=False)
        for n in ("original", "augmented")
    ]
    before, after = (np.asarray(run["qpos"]) for run in runs)
    part = cut(largebox, 0, 12)
    poses = part.object_poses.copy()
    poses[:, :3] += (after - before)[:12, 36:39]
    nominal = retarget(part, G1)
    motion = retarget(replace(part, object_poses=poses), G1, nominal=nominal)
    ours = motion.qpos[:, 1] - nominal.qpos[:, 1]
    # Theirs: -0.17 m at first, -0.19 m after ten frames, with the box moved by -0.2 m.
    np.testing.assert_allclose(ours, (after - before)[:12, 1], atol=0.05)


def test_refinement_stays_anchored(nominal, anchored):
    after = refine(anchored)
    assert after.nominal is anchored.nominal
    assert np.linalg.norm(after.qpos[0, :3] - nominal.qpos[0, :3]) < 0.05
    turn = rotations.difference(nominal.qpos[0, 3:7], after.qpos[0, 3:7])
    assert np.linalg.norm(turn) < 0.3


def test_bad_nominal_motions_are_refused(aside, nominal):
    with pytest.raises(InvalidDataError, match=r"Nominal motion .* \(60, 36\)"):
        retarget(aside, G1, nominal=nominal.qpos[:-1])
    broken = nominal.qpos.copy()
    broken[3, 4] = np.nan
    with pytest.raises(InvalidDataError, match=r"\(3, 4\)"):
        retarget(aside, G1, nominal=broken)
    with pytest.raises(InvalidOptionError, match="nominal_decay"):
        RetargetOptions(nominal_decay=0.0)
