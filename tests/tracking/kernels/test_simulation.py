import numpy as np

from omni_envs.tracking import kernels


def test_joint_targets():
    actions = np.array([[0.5, -20.0], [np.nan, 1.0], [1.0, np.inf]])
    default, scale = np.full((3, 2), 0.1), np.array([2.0, 3.0])
    action, target, bad = np.empty((3, 2)), np.empty((3, 2)), np.empty(3, bool)
    rows, lead = np.array([1, 0, 1]), np.array([[0.0, 0.0], [0.25, -1.0]])
    for added in (np.empty((0, 2)), lead):
        kernels.joint_targets(actions, 10.0, added, rows, default, scale, action, target, bad)
        expected = np.array([[0.5, -10.0], [0.0, 0.0], [0.0, 0.0]])
        expected += added[rows] if len(added) else 0.0
        np.testing.assert_array_equal(action, expected)
        np.testing.assert_allclose(target, 0.1 + scale * expected, atol=1e-15)
        assert bad.tolist() == [False, True, True]


def test_explosions_are_warnings_speeds_and_nan():
    qpos, qvel, warnings = np.zeros((5, 7)), np.zeros((5, 6)), np.zeros((5, 7, 2), np.int32)
    warnings[:, 3, 1], warnings[:, 5, 0] = 1, 1
    kinds = np.array([4, 5])
    out = np.empty(5, bool)
    assert not kernels.exploded(qpos, qvel, warnings, kinds, 100.0, out)
    qpos[1, 2], qvel[2, 0], qvel[3, 5], warnings[4, 5, 1] = np.inf, np.nan, -100.0, 1
    assert kernels.exploded(qpos, qvel, warnings, kinds, 100.0, out)
    assert out.tolist() == [False, True, True, True, True]


def test_models_are_exchanged_where_asked():
    source = np.arange(20.0).reshape(4, 5)
    out, model, warmstart = (np.zeros((5, 3)), np.zeros((5, 2))), np.full(5, 2), np.ones((5, 2))
    kernels.exchange_models(source, np.array([3, 0]), np.array([1, 4]), out, model, warmstart)
    whole = np.concatenate(out, axis=1)
    np.testing.assert_array_equal(whole[[1, 4]], source[[3, 0]])
    assert not whole[[0, 2, 3]].any()
    assert model.tolist() == [2, 3, 2, 2, 0]
    assert warmstart[:, 0].tolist() == [1, 0, 1, 1, 0]


def test_models_are_drawn_from_those_of_the_scene():
    chosen = np.empty(4, int)
    draws = np.array([0.0, 0.24, 0.25, 1.0 - 2.0**-53])
    kernels.choose_models(np.array([0, 2, 1]), np.array([0, 1, 2, 1]), 4, draws, chosen)
    assert chosen.tolist() == [0, 8, 5, 11]
