"""The published references are what the package makes."""

from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.generation import Manifest, read_recipe
from omni_envs.generation.generate import plan
from omni_envs.generation.item import file_hash
from omni_envs.references import Reference, make_reference

LIBRARY = Path(__file__).parents[2] / "references"


@pytest.fixture(scope="module")
def items():
    planned, broken = plan(read_recipe(LIBRARY / "recipe.yaml"))
    assert not broken
    return {item.name: item for item in planned}


def test_everything_the_recipe_asks_for_is_there(items):
    rows = Manifest(LIBRARY).rows
    assert items.keys() == rows.keys()
    for name, item in items.items():
        assert file_hash(LIBRARY / item.file) == rows[name]["sha256"]
        assert rows[name]["frames"] == item.frames
    for robot in ("g1", "h1", "t1"):
        for task in ("box_carry", "climb", "crawl"):
            assert f"{task}/{robot}/nominal" in items
            assert (LIBRARY / f"previews/{task}_{robot}_nominal.png").is_file()


def test_one_made_again_is_the_same(items):
    item = items["box_carry/g1/nominal"]
    published = Reference.load(LIBRARY / item.file)
    again = make_reference(builtin_demonstration("box_carry"), "g1")
    np.testing.assert_allclose(again.object_poses, published.object_poses, atol=1e-9)
    # Machines round differently, and the way of the solver depends on that a little.
    assert np.abs(again.qpos - published.qpos).max() < 0.02
    ours, theirs = again.report.summary(), published.report.summary()
    assert ours["energy_mean"] == pytest.approx(theirs["energy_mean"], rel=0.01)


def test_published_references_hold_the_bars_that_they_claim(items):
    for name in items:
        summary = Manifest(LIBRARY).rows[name]["summary"]
        assert summary["penetration_max_m"] <= 1e-3, name
        assert summary["self_penetration_max_m"] <= 1e-3, name
        assert summary["joint_violation_max_rad"] == summary["velocity_violation_max_rad_s"] == 0
