import numpy as np
import pytest

from omni_envs.retargeting.feet_task import FeetTask
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.robots import G1
from omni_envs.scenes import Scene


class Height(FeetTask):
    """The toe tip of the right foot at a height."""

    def __init__(self, height, weight):
        rows = np.zeros((1, 2, 3, 3))
        rows[0, 1, 0, 2] = 1.0
        self._wish(np.array([weight]), np.array([height]), rows)


class Nothing(FeetTask):
    def __init__(self):
        self._wish(np.zeros(0), np.zeros(0), np.zeros((0, 2, 3, 3)))


def test_cost_of_a_row():
    configuration = Kinematics(G1, Scene())
    configuration.update(G1.default_qpos)
    tip = configuration.feet()[1, 0, 2]
    model = Height(tip + 0.1, 20.0).quadratic(configuration)
    assert model.value == pytest.approx(0.5 * 20.0 * 0.1**2)
    # Lifting the root lifts the toe.
    assert model.g[2] == pytest.approx(-20.0 * 0.1) and model.H[2, 2] == pytest.approx(20.0)


def test_no_rows_are_off():
    assert Nothing().quadratic(Kinematics(G1, Scene())) is None
