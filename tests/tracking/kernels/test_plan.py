import numpy as np

from omni_envs.tracking import kernels
from omni_envs.tracking.kernels.plan import clock_rows
from omni_envs.tracking.motion import Columns


def test_a_plan_is_unpacked_as_it_was_packed():
    rng = np.random.default_rng(0)
    numbers = kernels.Numbers(
        anchor=3,
        root_nq=36,
        root_nv=35,
        has_object=True,
        oriented=np.array([True, False, True]),
        end_effectors=np.array([1, 2]),
        lower=rng.normal(size=4),
        upper=rng.normal(size=4),
        columns=np.array([0, 2, 5]),
        inverse_variance=rng.normal(size=3),
        weights=rng.normal(size=6),
        samples=4,
        by_substep=False,
        contact_force=1.5,
        thresholds=rng.normal(size=5),
        state_estimation=True,
        noise_start=58,
        noise_width=np.empty(0),
    )
    at = Columns(*range(10, 18))
    tree = kernels.Tree(
        parent=np.array([-1, 0]),
        slot=np.array([0, -1]),
        position=rng.normal(size=(2, 3)),
        quaternion=rng.normal(size=(2, 4)),
        first=np.array([0, 0, 3]),
        axis=rng.normal(size=(3, 3)),
        anchor=rng.normal(size=(3, 3)),
        zero=rng.normal(size=3),
        joint=np.array([2, 0, 1]),
        turned=np.array([0, 1]),
        aside=np.array([1, 0, 0]),
    )
    found = kernels.unpack(*kernels.make_plan(numbers, at, tree))
    for part, expected in zip(found, (numbers, at, tree), strict=True):
        assert type(part) is type(expected)
        for name, value in expected._asdict().items():
            np.testing.assert_array_equal(getattr(part, name), value, err_msg=name)


def test_clocks_are_the_rows_by_name():
    table = np.arange(14).reshape(7, 2)
    for row, name in zip(table, kernels.Clocks._fields, strict=True):
        np.testing.assert_array_equal(getattr(clock_rows(table), name), row)
