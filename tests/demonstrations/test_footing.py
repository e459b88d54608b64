import numpy as np
import pytest

from omni_envs.demonstrations import load_demonstration, scale_demonstration
from omni_envs.demonstrations.footing import SAME_GROUND, knee_floor, stand_on_ground
from omni_envs.robots import KEYPOINTS

FPS = 30.0
HIP, KNEE, ANKLE, TOE = range(4)  # joints of a leg; the left leg's come first


def walker(heights=(0.02, 0.05), steps=6):
    """(T, 8, 3) joints of two legs that stand 20 frames and swing 10, toes at their heights.

    ``heights`` has a height (m) for either foot, or an array of one per step.
    """
    frames = 30 * steps + 15
    t = np.arange(frames)
    legs = []
    for foot in range(2):
        clock = t - 15 * foot
        step, phase = np.maximum(clock // 30, 0), np.clip(clock % 30 - 20, 0, 10) / 10
        phase = np.where(clock < 0, 0.0, phase)
        rise = np.broadcast_to(np.asarray(heights[foot], float), steps + 2)
        toe = np.zeros((frames, 3))
        toe[:, 0] = 0.6 * (step + phase)
        toe[:, 1] = 0.1 - 0.2 * foot
        toe[:, 2] = rise[step] + phase * (rise[step + 1] - rise[step])
        toe[:, 2] += 0.1 * np.sin(np.pi * phase)
        up = np.array([0.0, 0.0, 1.0])
        legs += [toe + 0.9 * up, toe + 0.5 * up, toe + np.array([-0.12, 0, 0.06]), toe]
    return np.stack(legs, axis=1)


def grounded(legs):
    feet = ((ANKLE, TOE), (4 + ANKLE, 4 + TOE))
    toes, knees = legs[:, [TOE, 4 + TOE]], legs[:, [KNEE, 4 + KNEE]]
    return stand_on_ground(legs, toes, knees, feet, FPS)


def standing(legs, foot):
    """(T,) bool: the toe does not move."""
    toe = legs[:, 4 * foot + TOE, 0]
    return np.abs(np.gradient(toe)) * FPS < 0.02


def test_both_feet_stand_on_the_ground_and_the_body_comes_along():
    legs = walker()
    found = grounded(legs)
    np.testing.assert_array_equal(found[..., :2], legs[..., :2])
    for foot in range(2):
        np.testing.assert_allclose(found[standing(legs, foot), 4 * foot + TOE, 2], 0, atol=1e-9)
        # A foot moves as a whole: it keeps its pitch.
        np.testing.assert_allclose(
            found[:, 4 * foot + ANKLE] - found[:, 4 * foot + TOE],
            legs[:, 4 * foot + ANKLE] - legs[:, 4 * foot + TOE],
            atol=1e-12,
        )
    lowered = (
        legs[:, [HIP, KNEE, 4 + HIP, 4 + KNEE], 2] - found[:, [HIP, KNEE, 4 + HIP, 4 + KNEE], 2]
    )
    assert np.ptp(lowered) < 1e-12 and 0.02 - 1e-9 < lowered[0, 0] < 0.05 + 1e-9


def test_every_step_has_its_own_height():
    rng = np.random.default_rng(0)
    legs = walker([rng.uniform(0.01, 0.05, 8), rng.uniform(0.01, 0.05, 8)])
    found = grounded(legs)
    for foot in range(2):
        np.testing.assert_allclose(found[standing(legs, foot), 4 * foot + TOE, 2], 0, atol=2e-3)
    # In between nothing jumps: no foot gains more than 4 cm in a swing.
    change = np.diff(found[..., 2] - legs[..., 2], axis=0) * FPS
    assert np.abs(change).max() < 0.04 * FPS / 6


def test_one_frame_below_the_ground_does_not_lift_everyone():
    legs = walker((0.02, 0.02))
    legs[100, TOE, 2] = -0.08
    found = grounded(legs)
    assert found[50, TOE, 2] == pytest.approx(0, abs=1e-9)
    assert found[:, [TOE, 4 + TOE], 2].min() == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("box", [0.2, 0.35])
def test_a_box_that_was_not_recorded_is_not_flattened(box):
    steps = np.array([0.02] * 4 + [0.02 + box] * 4)
    found = grounded(walker([steps, steps]))
    assert box > SAME_GROUND
    assert found[-1, TOE, 2] == pytest.approx(box, abs=1e-9)
    assert found[0, TOE, 2] == pytest.approx(0, abs=1e-9)


def test_a_foot_held_in_the_air_is_not_put_down():
    """One-legged balance: the lifted foot does not move either."""
    legs = walker((0.02, 0.02), steps=1)[:1].repeat(90, axis=0)
    lift = 0.3 * np.clip(np.arange(90) / 10 - 3, 0, 1)
    legs[:, :4, 2] += lift[:, None]
    found = grounded(legs)
    np.testing.assert_allclose(found[:, TOE, 2], lift, atol=1e-9)
    np.testing.assert_allclose(found[:, 4 + TOE, 2], 0, atol=1e-9)


def test_someone_who_never_stands_has_the_lowest_toe_on_the_ground():
    legs = walker(steps=1)
    legs[..., 0] += np.arange(len(legs))[:, None] * 0.1  # skates all the time
    found = grounded(legs)
    assert found[:, [TOE, 4 + TOE], 2].min() == pytest.approx(0, abs=1e-12)
    assert np.ptp(found[..., 2] - legs[..., 2]) < 1e-12


def test_knees_carry_someone_who_kneels():
    legs = walker((0.05, 0.05), steps=1)[:1].repeat(60, axis=0)
    legs[:, [KNEE, 4 + KNEE], 2] = 0.03
    found = grounded(legs)
    assert found[:, [KNEE, 4 + KNEE], 2].min() == pytest.approx(0.04)
    np.testing.assert_allclose(found[:, [TOE, 4 + TOE], 2], 0, atol=1e-12)


def test_knee_floor_forgives_a_stray_frame():
    knees = np.full((300, 2, 3), 0.3)
    knees[7, 0, 2] = -1.0
    assert knee_floor(knees, FPS) == pytest.approx(0.26)
    knees[100:150, 1, 2] = 0.02
    assert knee_floor(knees, FPS) == pytest.approx(-0.02)


@pytest.mark.parametrize("clip", ["B03_Walk1", "B09_WalkTurnLeft90", "B21_PutDownBoxToWalk"])
def test_recorded_walks_stand_on_the_ground(shared, clip):
    """Before, left toes of the walk stood 4 to 7 cm above the ground."""
    demo = load_demonstration(shared / f"data/accad/Female1_{clip}.bvh")
    source = scale_demonstration(demo, demo.height)
    for foot, side in enumerate(("left", "right")):
        toe = source.keypoints[:, KEYPOINTS.index(f"{side}_toe"), 2]
        stance = source.stance["default"][:, foot]
        assert stance.sum() > 40
        assert np.median(toe[stance]) < 2e-3 and np.percentile(toe[stance], 90) < 0.02
        assert toe.min() >= -1e-12
