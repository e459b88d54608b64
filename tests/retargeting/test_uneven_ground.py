"""A height field is terrain like any other: the crawl on the same slope, once as a grid."""

from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, scale_demonstration
from omni_envs.demonstrations.builtin.crawl_plan import height
from omni_envs.metrics import evaluate
from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.surface_points import surface_points
from omni_envs.robots import G1
from omni_envs.scenes import uneven_ground

FIRST, LAST = 225, 255  # on the slope


def grid():
    """The slope and the block of the crawl as a height field."""
    x = np.linspace(0.0, 3.0, 61)
    return uneven_ground(np.tile([height(v) for v in x], (13, 1)), (3.0, 1.6), (1.5, 0.0))


def part(demo):
    """One second of a demonstration at the robot's scale."""
    source = scale_demonstration(demo, G1.height)
    cut = slice(FIRST, LAST)
    return replace(
        source,
        keypoints=source.keypoints[cut],
        stance={k: v[cut] for k, v in source.stance.items()},
        contacts={k: v[cut] for k, v in source.contacts.items()},
        contact_points={k: v[cut] for k, v in source.contact_points.items()},
    )


@pytest.fixture(scope="module")
def sources():
    demo = builtin_demonstration("crawl")
    return part(demo), part(replace(demo, scene=grid()))


def test_the_same_places_are_touched(sources):
    parts, field = sources
    for link, flags in parts.contacts.items():
        assert (flags == field.contacts[link]).mean() > 0.9, link
        both = flags & field.contacts[link]
        gap = parts.contact_points[link][both] - field.contact_points[link][both]
        assert np.abs(gap).max(initial=0.0) < 0.02


def test_its_points_are_sampled_into_the_mesh(sources):
    points = surface_points(sources[1], 100).source
    assert points.shape == (100, 3)
    expected = np.array([height(x / sources[1].scale) for x in points[:, 0]]) * sources[1].scale
    np.testing.assert_allclose(points[:, 2], expected, atol=0.01)


def test_retargeted_without_penetration_and_in_contact(sources):
    field = sources[1]
    motion = retarget(field, G1, RetargetOptions())
    report = evaluate(G1, field.scene, field.fps, motion.qpos, None, field)
    assert set(report.penetration) >= {"terrain", "ground"}
    assert report.surroundings_penetration.max() < 1e-3
    summary = report.summary()
    assert summary["contact_fraction_2cm"] > 0.95
    assert not motion.frames.relaxed.any()
