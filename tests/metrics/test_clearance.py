import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.metrics import evaluate
from omni_envs.metrics.clearance import sole_clearance, stance_clearance
from omni_envs.metrics.playback import REACH, play
from omni_envs.robots import G1, KEYPOINTS
from omni_envs.scenes import Scene

UP = np.array([0.0, 0.0, 1.0])
SOLE = np.array(G1.feet["left"].sole)


def clearance_of(qpos):
    playback = play(G1, Scene(), 50.0, qpos, None)
    return sole_clearance(playback, np.tile(UP, (len(qpos), 2, 1)))


def pitched(qpos, angle):
    """The motion, turned as a whole about the left lateral axis."""
    out = qpos.copy()
    turn = rotations.exp(np.array([0.0, angle, 0.0]))
    out[:, 3:7] = rotations.multiply(turn, qpos[:, 3:7])
    return out


def test_a_flat_foot_has_none_and_a_lifted_one_what_it_is_lifted_by(standing):
    np.testing.assert_allclose(clearance_of(standing(2)), 0.0, atol=2e-3)
    np.testing.assert_allclose(clearance_of(standing(2, lift=0.03)), 0.03, atol=2e-3)
    np.testing.assert_allclose(clearance_of(standing(1, lift=0.5)), REACH, atol=2e-3)


def test_on_tiptoe_the_heel_counts(standing):
    qpos = pitched(standing(1, lift=0.2), 0.2)
    soles = play(G1, Scene(), 50.0, qpos, None).soles()[0, 0, :, 2]
    qpos[:, 2] -= soles.min()
    length = np.ptp(SOLE[:, 0])
    np.testing.assert_allclose(clearance_of(qpos)[0], np.sin(0.2) * length, atol=5e-3)


def test_the_usual_clearance_of_each_run_of_flat_frames():
    clearance = np.tile(np.array([0, 9, 2, 2, 5, 2, 0, 7, 7, 7, 7, 7.0])[:, None], 2)
    flat = np.zeros((12, 2), bool)
    flat[1:6, 0] = flat[7:, 0] = True
    flat[1:3, 1] = True  # too short to be a stance
    usual = stance_clearance(clearance, flat, 50.0)
    expected = [np.nan, 2, 2, 2, 2, 2, np.nan, 7, 7, 7, 7, 7]
    np.testing.assert_array_equal(usual[:, 0], expected)
    assert np.isnan(usual[:, 1]).all()


@pytest.mark.parametrize(("heel_raised", "counted"), [(0.0, True), (0.12, False)])
def test_counts_where_the_human_stands_flat(standing, make_source, heel_raised, counted):
    qpos = standing(20, lift=0.03)
    keypoints = play(G1, Scene(), 50.0, qpos, None).keypoints()
    for side in ("left", "right"):
        toe, ankle = (KEYPOINTS.index(f"{side}_{joint}") for joint in ("toe", "ankle"))
        keypoints[:, ankle] = keypoints[:, toe] + [-0.12, 0.0, 0.05 + heel_raised]
    summary = evaluate(G1, Scene(), 50.0, qpos, source=make_source(keypoints)).summary()
    if counted:
        assert summary["stance_clearance_max_m"] == pytest.approx(0.03, abs=2e-3)
    else:
        assert summary["stance_clearance_max_m"] is None
