from dataclasses import replace

import numpy as np
import pytest

from omni_envs.metrics import evaluate
from omni_envs.metrics.reach import FAR, Miss, missed_contacts
from omni_envs.robots import G1
from omni_envs.scenes import Scene


@pytest.fixture
def report(standing):
    """Of 60 frames at 50 per second, with gaps of the hands to be filled in."""
    return evaluate(G1, Scene(), 50.0, standing(60))


def with_gaps(report, **links):
    gaps = {}
    for link, parts in links.items():
        gaps[link] = np.full(60, np.nan)
        for start, stop, gap in parts:
            gaps[link][start:stop] = gap
    return replace(report, contact_gap=gaps)


def test_lasting_misses_are_told_the_farthest_first(report):
    found = missed_contacts(
        with_gaps(report, left_hand=[(5, 25, 0.07), (25, 40, 0.01)], right_foot=[(30, 50, 0.12)])
    )
    assert found == [Miss("right_foot", 30, 50, 0.12), Miss("left_hand", 5, 25, 0.07)]
    assert str(found[0]) == "right foot by 12 cm (frames 30 to 49)"


def test_what_is_near_or_short_is_no_miss(report):
    near = with_gaps(report, left_hand=[(0, 60, FAR)], right_hand=[(10, 14, 0.3)])
    assert missed_contacts(near) == [] and missed_contacts(report) == []


def test_a_short_pause_does_not_part_a_miss(report):
    parted = with_gaps(report, left_hand=[(5, 20, 0.06), (20, 26, 0.02), (26, 40, 0.08)])
    assert missed_contacts(parted) == [Miss("left_hand", 5, 40, 0.08)]
    apart = with_gaps(report, left_hand=[(5, 20, 0.06), (20, 32, 0.02), (32, 45, 0.08)])
    assert [(m.start, m.stop) for m in missed_contacts(apart)] == [(32, 45), (5, 20)]
