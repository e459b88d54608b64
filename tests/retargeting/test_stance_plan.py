import numpy as np
import pytest

from omni_envs.retargeting.human_feet import HumanFeet
from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import (
    ANCHORED,
    FREE,
    LOOSE,
    FootWishes,
    _overlaps,
    plan_stance,
    stance_tiers,
)

OPTIONS, WIDTH = StanceOptions(), 0.06


def wishes(tips, headings=None, reach=None, lying=1.0):
    frames = len(tips)
    both = np.stack([tips, np.zeros_like(tips)], axis=1)
    return FootWishes(
        both,
        np.zeros((frames, 2)) if headings is None else np.stack([headings] * 2, axis=1),
        np.full((frames, 2), -0.1) if reach is None else np.stack([reach] * 2, axis=1),
        np.full((frames, 2), lying),
        np.full(2, 0.1),
    )


def human(frames, pivots=slice(0, 0)):
    flags = np.zeros((frames, 2), bool)
    flags[pivots] = True
    axes = np.tile(np.eye(3)[:2], (frames, 2, 1, 1))
    support, flat = np.full((frames, 2), np.inf), np.zeros((frames, 2), bool)
    return HumanFeet(flags, np.zeros((frames, 2)), axes, support, flat)


def plan_of(tier, wished, pivots=slice(0, 0)):
    return plan_stance(tier, wished, WIDTH, human(len(tier), pivots), 30.0, OPTIONS)


def tiers(left):
    return np.stack([left, np.full(len(left), FREE)], axis=1)


def test_foothold_is_the_middle_of_the_wishes():
    tips = np.zeros((20, 2))
    tips[5:15, 0] = np.linspace(0.0, 0.02, 10)
    tier = np.full(20, FREE)
    tier[5:15] = ANCHORED
    plan = plan_of(tiers(tier), wishes(tips))
    np.testing.assert_allclose(plan.tips[5:15, 0, 0], 0.01)
    np.testing.assert_allclose(plan.tip_slack[5:15, 0], OPTIONS.tolerance)
    # The window before it narrows towards it.
    before = plan.tip_slack[:5, 0]
    assert (np.diff(before) < 0).all() and before[-1] > OPTIONS.tolerance
    assert np.isinf(plan.tip_slack[:, 1]).all()


def test_footholds_a_loose_foot_cannot_walk_are_drawn_together():
    tips = np.zeros((20, 2))
    tips[12:, 0] = 0.1
    tier = np.full(20, LOOSE)
    tier[:8] = tier[12:] = ANCHORED
    plan = plan_of(tiers(tier), wishes(tips))
    step = OPTIONS.loose_speed / 30 / np.sqrt(2)
    assert plan.tips[15, 0, 0] - plan.tips[3, 0, 0] == pytest.approx(5 * step)


def test_far_turns_and_rolls_are_let_while_the_human_pivots():
    tier, late = tiers(np.full(30, ANCHORED)), slice(20, 30)
    still = plan_of(tier, wishes(np.zeros((30, 2))), late)
    assert not still.turns.any() and not still.rolls.any()
    far_turn = wishes(np.zeros((30, 2)), headings=np.linspace(0, 2, 30))
    far_roll = wishes(np.zeros((30, 2)), reach=np.linspace(-0.1, -0.05, 30))
    turn, roll = plan_of(tier, far_turn, late), plan_of(tier, far_roll, late)
    for let in (turn.turns, roll.rolls):
        assert let[late, 0].all() and not let[:20].any() and not let[:, 1].any()
    for wished in (far_turn, far_roll):
        held = plan_of(tier, wished)
        assert not held.turns.any() and not held.rolls.any()


def test_a_foot_that_comes_down_from_its_toes_rolls_until_it_is_flat():
    tier, wished = tiers(np.full(30, ANCHORED)), wishes(np.zeros((30, 2)))
    feet = human(30, slice(5, 12))
    feet.pivots[20:25] = True  # and once more later
    feet.flat[10:] = True
    plan = plan_stance(tier, wished, WIDTH, feet, 30.0, OPTIONS)
    np.testing.assert_array_equal(np.flatnonzero(plan.rolls[:, 0]), np.arange(5, 12))
    feet.flat[:] = False  # one that never stands flat does not
    assert not plan_stance(tier, wished, WIDTH, feet, 30.0, OPTIONS).rolls.any()


def test_footholds_leave_room_for_both_feet():
    tier = np.full((30, 2), ANCHORED)
    tier[:5, 0] = tier[25:, 1] = FREE
    tips = wishes(np.zeros((30, 2)))
    tips.tips[:, 1, 1] = -0.02
    feet = human(30)
    feet.support[:] = 0.0
    plan = plan_stance(tier, tips, WIDTH, feet, 30.0, OPTIONS)
    np.testing.assert_allclose(plan.tips[15], [[0.0, 0.02], [0.0, -0.04]], atol=1e-4)
    feet.support[:, 0] = 0.3  # one stands on a step
    apart = plan_stance(tier, tips, WIDTH, feet, 30.0, OPTIONS)
    np.testing.assert_allclose(apart.tips[15], [[0.0, 0.0], [0.0, -0.02]])


def test_overlapping_intervals_are_found():
    rng = np.random.default_rng(0)
    first, second = (
        [(int(a), int(b)) for a, b in np.sort(rng.choice(200, 40, replace=False)).reshape(-1, 2)]
        for _ in range(2)
    )
    expected = [
        (i, j)
        for i, a in enumerate(first)
        for j, b in enumerate(second)
        if max(a[0], b[0]) < min(a[1], b[1])
    ]
    assert len(expected) > 10 and list(_overlaps(first, second)) == expected


def test_a_foot_that_lies_may_rise():
    tier = tiers(np.full(30, ANCHORED))
    assert not plan_of(tier, wishes(np.zeros((30, 2)))).rise[:, 0].any()
    assert np.isinf(plan_of(tier, wishes(np.zeros((30, 2)), lying=0.5)).rise).all()


def test_feet_on_their_side_are_held_whole():
    tier = tiers(np.full(30, ANCHORED))
    far = {"headings": np.linspace(0, 2, 30), "reach": np.linspace(-0.1, -0.05, 30)}
    plan = plan_of(tier, wishes(np.zeros((30, 2)), **far, lying=0.5), slice(0, 30))
    assert not plan.turns.any() and not plan.rolls.any()


def test_tiers_are_the_sources_sets(grasp):
    tier = stance_tiers(grasp, OPTIONS)
    assert ((tier == ANCHORED) == (grasp.stance["default"] | grasp.stance["text"])).all()
    assert (tier[grasp.stance["code"]] >= LOOSE).all()
    free = stance_tiers(grasp, StanceOptions(anchored=None, loose=None))
    assert (free == FREE).all()
