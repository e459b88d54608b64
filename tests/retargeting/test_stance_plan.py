import numpy as np
import pytest

from omni_envs.retargeting.options import StanceOptions
from omni_envs.retargeting.stance_plan import (
    ANCHORED,
    FREE,
    LOOSE,
    FootWishes,
    plan_stance,
    stance_tiers,
)

OPTIONS = StanceOptions()


def wishes(tips, headings=None, reach=None, lying=1.0):
    frames = len(tips)
    both = np.stack([tips, np.zeros_like(tips)], axis=1)
    return FootWishes(
        both,
        np.zeros((frames, 2)) if headings is None else np.stack([headings] * 2, axis=1),
        np.full((frames, 2), -0.1) if reach is None else np.stack([reach] * 2, axis=1),
        np.full((frames, 2), lying),
    )


def tiers(left):
    return np.stack([left, np.full(len(left), FREE)], axis=1)


def test_foothold_is_the_middle_of_the_wishes():
    tips = np.zeros((20, 2))
    tips[5:15, 0] = np.linspace(0.0, 0.02, 10)
    tier = np.full(20, FREE)
    tier[5:15] = ANCHORED
    plan = plan_stance(tiers(tier), wishes(tips), 30.0, OPTIONS)
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
    plan = plan_stance(tiers(tier), wishes(tips), 30.0, OPTIONS)
    step = OPTIONS.loose_speed / 30 / np.sqrt(2)
    assert plan.tips[15, 0, 0] - plan.tips[3, 0, 0] == pytest.approx(5 * step)


def test_far_turns_and_rolls_are_let():
    tier = tiers(np.full(30, ANCHORED))
    still = plan_stance(tier, wishes(np.zeros((30, 2))), 30.0, OPTIONS)
    assert not still.turns.any() and not still.rolls.any()
    turn = plan_stance(
        tier, wishes(np.zeros((30, 2)), headings=np.linspace(0, 2, 30)), 30.0, OPTIONS
    )
    assert turn.turns[:, 0].all() and not turn.turns[:, 1].any()
    roll = plan_stance(
        tier, wishes(np.zeros((30, 2)), reach=np.linspace(-0.1, -0.05, 30)), 30.0, OPTIONS
    )
    assert roll.rolls[:, 0].all()


def test_feet_on_their_side_are_held_whole():
    tier = tiers(np.full(30, ANCHORED))
    far = {"headings": np.linspace(0, 2, 30), "reach": np.linspace(-0.1, -0.05, 30)}
    plan = plan_stance(tier, wishes(np.zeros((30, 2)), **far, lying=0.5), 30.0, OPTIONS)
    assert not plan.turns.any() and not plan.rolls.any()


def test_tiers_are_the_sources_sets(grasp):
    tier = stance_tiers(grasp, OPTIONS)
    assert ((tier == ANCHORED) == (grasp.stance["default"] | grasp.stance["text"])).all()
    assert (tier[grasp.stance["code"]] >= LOOSE).all()
    free = stance_tiers(grasp, StanceOptions(anchored=None, loose=None))
    assert (free == FREE).all()
