import numpy as np
import pytest

from omni_envs.retargeting import RetargetOptions
from omni_envs.retargeting.contact_limit import ContactLimit
from omni_envs.retargeting.joint_limits import JointLimit
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.limits import CONTACT, STANCE, RowLimit, Rows
from omni_envs.retargeting.restoration import restore, row_violations
from omni_envs.retargeting.solver import solve_daqp
from omni_envs.robots import G1
from omni_envs.scenes import Scene

OPTIONS = RetargetOptions()


@pytest.fixture(scope="module")
def configuration():
    return Kinematics(G1, Scene())


class Lengths(RowLimit):
    """Windows of two nearly parallel functions of a configuration: they contradict by ``gap``."""

    def __init__(self, gap: float, kinds=(STANCE, STANCE)) -> None:
        self.gap, self.kinds = gap, np.array(kinds)

    def rows(self, configuration):
        q = configuration.data.qpos
        x, angle = q[0], q[7] - G1.default_qpos[7]
        A = np.zeros((2, configuration.model.nv))
        A[:, 0] = 1.0
        A[1, 6] = 1e-3  # the way out is long
        lower = np.array([0.5 * self.gap - x, -np.inf])
        upper = np.array([np.inf, -0.5 * self.gap - x - 1e-3 * angle])
        return Rows(A, lower, upper, self.kinds)


def at(configuration, **joints):
    q = G1.default_qpos.copy()
    q[0] = 0.0
    for joint, value in joints.items():
        q[7 + G1.joint_names.index(joint)] = value
    configuration.update(q)
    return q


def test_what_sinks_into_the_ground_comes_up_and_no_further(configuration):
    q = at(configuration)
    q[2] -= 0.03
    configuration.update(q)
    limits = [ContactLimit(0.0)]
    before = row_violations(limits[0].rows(configuration))
    assert before[2] > 0.02
    restored = restore(configuration, [JointLimit(G1)], limits, solve_daqp, OPTIONS)
    assert max(restored.violations) <= OPTIONS.restoration_tolerance and not restored.soft
    way = configuration.difference(q)
    assert np.abs(way).max() <= 1.2 * before[2]


def test_a_contradiction_by_a_hair_is_not_worth_a_contortion(configuration):
    q = at(configuration)
    restored = restore(configuration, [], [Lengths(1e-4)], solve_daqp, OPTIONS)
    # Meeting both windows takes 0.1 rad.
    assert np.abs(configuration.difference(q)).max() < 0.02
    assert max(restored.violations) <= 6e-5 and restored.soft


def test_the_stronger_row_wins(configuration):
    at(configuration)
    limit = Lengths(2e-3, (STANCE, CONTACT))
    restored = restore(configuration, [], [limit], solve_daqp, OPTIONS)
    assert restored.violations[2] < 2e-5 < restored.violations[0]
    np.testing.assert_allclose(row_violations(limit.rows(configuration)), restored.violations)


def test_the_best_configuration_on_the_way_is_kept(configuration):
    def away(qp):
        dq = np.zeros(len(qp.g))
        dq[2] = -0.01
        return dq, True

    q = at(configuration)
    q[2] -= 0.01
    configuration.update(q)
    limit = ContactLimit(0.0)
    before = row_violations(limit.rows(configuration))
    restored = restore(configuration, [], [limit], away, OPTIONS)
    assert restored.steps == OPTIONS.restoration_iterations
    assert restored.violations == before
    np.testing.assert_array_equal(configuration.data.qpos, q)
