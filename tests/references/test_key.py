from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.references.key import content_hashes, reference_key
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import G1


@pytest.fixture
def demonstration():
    return builtin_demonstration("box_carry")


def test_the_key_covers_everything(demonstration, tmp_path):
    options = RetargetOptions()
    base = reference_key(demonstration, G1, 50.0, options)
    assert reference_key(builtin_demonstration("box_carry"), G1, 50.0, RetargetOptions()) == base
    copy = tmp_path / "elsewhere.xml"
    copy.write_text(G1.mjcf.read_text())
    assert reference_key(demonstration, replace(G1, mjcf=copy), 50.0, options) == base

    copy.write_text(G1.mjcf.read_text() + "<!-- another robot -->")
    moved = demonstration.positions.copy()
    moved[3, 2, 1] += 1e-9
    box = demonstration.scene.object
    touching = np.ones(demonstration.num_frames, bool)
    variants = [
        (replace(demonstration, positions=moved), G1, 50.0, options),
        (replace(demonstration, fps=31.0), G1, 50.0, options),
        (replace(demonstration, height=1.7), G1, 50.0, options),
        (
            replace(demonstration, scene=replace(demonstration.scene, object=box.scaled(1.1))),
            G1,
            50.0,
            options,
        ),
        (
            replace(demonstration, contacts={"left_hand": touching}),
            G1,
            50.0,
            options,
        ),
        (demonstration, replace(G1, mjcf=copy), 50.0, options),
        (demonstration, replace(G1, height=1.3), 50.0, options),
        (demonstration, replace(G1, actuators=G1.actuators[::-1]), 50.0, options),
        (demonstration, G1, 30.0, options),
        (demonstration, G1, 50.0, RetargetOptions(trust_region=0.1)),
    ]
    keys = {reference_key(*v) for v in variants}
    assert len(keys | {base}) == len(variants) + 1


def test_every_part_has_its_own_hash(demonstration):
    base = content_hashes(demonstration, G1, 50.0, RetargetOptions())
    assert {len(h) for h in base.values()} == {64}
    other = content_hashes(demonstration, replace(G1, height=1.3), 50.0, RetargetOptions())
    assert {k for k in base if base[k] != other[k]} == {"robot"}
    other = content_hashes(demonstration, G1, 30.0, RetargetOptions())
    assert {k for k in base if base[k] != other[k]} == {"settings"}
    scene = replace(demonstration.scene, ground_friction=0.5)
    other = content_hashes(replace(demonstration, scene=scene), G1, 50.0, RetargetOptions())
    assert {k for k in base if base[k] != other[k]} == {"demonstration", "scene"}
