import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, scale_demonstration
from omni_envs.metrics import evaluate
from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.sole_task import SoleTask
from omni_envs.robots import G1, T1
from omni_envs.scenes import Scene

WEIGHT = 100.0


@pytest.fixture
def configuration():
    return Kinematics(G1, Scene())


@pytest.fixture
def human():
    """The left foot is flat on ground from frame 10 on, the right one never is."""
    flat = np.zeros((20, 2), bool)
    flat[10:, 0] = True
    return HumanFeet(
        pivots=np.zeros((20, 2), bool),
        rise=np.zeros((20, 2)),
        axes=np.tile(np.eye(3)[:2], (20, 2, 1, 1)),
        support=np.where(flat, 0.0, np.inf),
        flat=flat,
    )


def cost(task, configuration, t):
    task.set_frame(t)
    model = task.quadratic(configuration)
    return None if model is None else model.value


def test_soles_on_the_support_cost_nothing_and_raised_ones_their_height(configuration, human):
    task = SoleTask(human, 50.0, WEIGHT)
    q = G1.default_qpos.copy()
    configuration.update(q)
    assert cost(task, configuration, 15) < WEIGHT * 2e-6
    q[2] += 0.03
    configuration.update(q)
    # Toe tip and heart of one foot.
    assert cost(task, configuration, 15) == pytest.approx(WEIGHT * 0.03**2, rel=0.1)


def test_a_sole_on_its_toes_or_its_edge_costs(configuration, human):
    task = SoleTask(human, 50.0, WEIGHT)
    costs = []
    for joint in ("left_ankle_pitch_joint", "left_ankle_roll_joint", "right_ankle_roll_joint"):
        q = G1.default_qpos.copy()
        q[7 + G1.joint_names.index(joint)] += 0.2
        configuration.update(q)
        costs.append(cost(task, configuration, 15))
    assert costs[0] > WEIGHT * 1e-4 and costs[1] > WEIGHT * 1e-4
    assert costs[2] < WEIGHT * 2e-6


def test_the_pull_grows_before_the_foot_lands(configuration, human):
    task = SoleTask(human, 50.0, WEIGHT)
    q = G1.default_qpos.copy()
    q[2] += 0.03
    configuration.update(q)
    costs = [cost(task, configuration, t) for t in range(20)]
    assert costs[:5] == [None] * 5
    np.testing.assert_allclose(np.diff(costs[5:11]), costs[10] / 6)
    assert costs[10:] == pytest.approx([costs[10]] * 10)


def test_short_legs_stand_on_whole_soles(cut):
    source = cut(scale_demonstration(builtin_demonstration("box_carry"), T1.height), 0, 60)
    highest = []
    for weight in (0.0, RetargetOptions().sole_weight):
        motion = retarget(source, T1, RetargetOptions(sole_weight=weight))
        report = evaluate(T1, source.scene, motion.fps, motion.qpos, motion.object_poses, source)
        highest.append(report.summary()["stance_clearance_max_m"])
    assert highest[0] > 0.03 and highest[1] < 0.01
