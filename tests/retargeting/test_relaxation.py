"""What gives way where constraints contradict each other, in which order, and that it is told.

Stance, then self-collision, then non-penetration. Speed limits would be next, joint limits never: a
frame that stays as the last one satisfies both, so neither is ever in contradiction with anything.
"""

from dataclasses import replace

import numpy as np
import pytest

from omni_envs.metrics import evaluate
from omni_envs.retargeting import RELAXATIONS, RetargetOptions, refine, retarget
from omni_envs.retargeting.clarabel_solver import solve_clarabel
from omni_envs.retargeting.limits import CONTACT, SELF, STANCE, Rows
from omni_envs.retargeting.qp import StepQP
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.robots import G1, KEYPOINTS
from omni_envs.scenes import Box, Part, Scene, SceneObject

TOLD = 2e-4  # m: what counts as relaxed
# Without the pull on soles: feet told to stand where they swing have no support to lie on.
FULL = RetargetOptions(sole_weight=0.0)
SLOW = replace(FULL, velocity_limits=0.02)


def standing(source, poses):
    """The source with another path of the object, and both feet on the ground all along."""
    stance = {mode: np.ones_like(flags) for mode, flags in source.stance.items()}
    return replace(source, object_poses=poses, stance=stance)


@pytest.fixture(scope="module")
def swaying(grasp):
    poses = grasp.object_poses.copy()
    poses[:, 0] += 0.4 * np.sin(2 * np.pi * np.arange(len(poses)) / 20)
    return standing(grasp, poses)


@pytest.fixture(scope="module")
def struck(grasp):
    """A block 1 m thick strikes the robot at 30 m/s: none is out of its way in time."""
    block = SceneObject("block", (Part(Box((0.5, 2.0, 1.0))),), mass=1.0)
    pelvis = grasp.keypoints[30, KEYPOINTS.index("pelvis")]
    poses = np.tile(
        [*np.add(pelvis, (1.5, 0.0, 0.0)), 1.0, 0.0, 0.0, 0.0], (len(grasp.keypoints), 1)
    )
    poses[30, 0] -= 1.0
    return replace(standing(grasp, poses), scene=Scene(object=block), contact_points={})


def excess(motion, fraction):
    """Largest excess over speed and joint limits, and the (T,) depth in the surroundings."""
    speed = np.abs(np.diff(motion.qpos[:, 7:], axis=0)) * motion.fps
    low, high = G1.reference_joint_ranges.T
    beyond = np.maximum(low - motion.qpos[:, 7:], motion.qpos[:, 7:] - high).max()
    report = evaluate(
        G1, motion.source.scene, motion.fps, motion.qpos, motion.object_poses, motion.source
    )
    return (speed - fraction * G1.velocity_limits).max(), beyond, report.summary()


@pytest.mark.parametrize("options", [FULL, SLOW], ids=["full speed", "2 %"])
def test_stance_gives_way_first(swaying, options):
    motion = retarget(swaying, G1, options)
    told = motion.frames.violations
    assert tuple(told) == RELAXATIONS == ("stance", "self_collision", "penetration")
    assert told["stance"].max() > 0.05
    assert told["self_collision"].max() <= TOLD
    # A box that jolts at 3 m/s: at full speed the robot gets out of its way but for single frames.
    full = options.velocity_limits == 1.0
    assert told["penetration"].max() <= (2e-3 if full else 0.01)
    assert not full or (told["penetration"] > TOLD).mean() <= 0.05
    speeding, beyond, _ = excess(motion, options.velocity_limits)
    assert speeding <= 0.0 and beyond <= 0.0


def test_penetration_gives_way_before_speed(struck):
    before = retarget(struck, G1, FULL)
    given_up = before.frames.violations["penetration"]
    assert given_up[30] > 0.01
    assert (before.frames.violations["stance"][given_up > TOLD] > TOLD).all()  # it went first
    for motion in (before, refine(before)):
        told = motion.frames.violations
        speeding, beyond, summary = excess(motion, FULL.velocity_limits)
        assert speeding <= 0.0 and beyond <= 0.0
        # What is told is what is there.
        assert summary["penetration_max_m"] == pytest.approx(told["penetration"].max(), abs=1e-4)
        worst = np.max(np.stack(list(told.values())), axis=0)
        np.testing.assert_array_equal(motion.frames.relaxed, worst > TOLD)


@pytest.mark.parametrize("solve", [solve_daqp, solve_clarabel])
@pytest.mark.parametrize(("weak", "strong"), [(STANCE, SELF), (SELF, CONTACT), (STANCE, CONTACT)])
def test_of_two_contradicting_rows_the_weaker_gives_way(solve, weak, strong):
    rows = Rows(
        np.array([[1.0, 0.0], [1.0, 0.0]]),
        np.array([-np.inf, 0.02]),
        np.array([-0.02, np.inf]),
        np.array([weak, strong]),
    )
    wide, metric = np.full(2, 1.0), np.ones(2)
    dq, soft = solve(StepQP(np.eye(2), np.zeros(2), -wide, wide, rows, metric, np.inf))
    assert soft and dq[0] == pytest.approx(0.02, abs=1e-3)
    # Bounds, where speed and joint limits are, give way to neither.
    narrow = np.full(2, 0.005)
    dq, soft = solve(StepQP(np.eye(2), np.zeros(2), -narrow, narrow, rows, metric, np.inf))
    assert soft and dq[0] == pytest.approx(0.005, abs=1e-6) and (np.abs(dq) <= narrow).all()
