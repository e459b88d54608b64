import re
from dataclasses import replace

import numpy as np
import pytest

from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, SceneObject

SCENE = Scene(SceneObject("crate", (Part(Box((0.2, 0.15, 0.15))),)))
POSE = np.array([0.6, 0.0, 0.15, 1.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def renderer():
    rendering = pytest.importorskip("omni_envs.scenes.rendering")
    try:
        renderer = rendering.SceneRenderer(G1, SCENE, width=160, height=120)
    except Exception as error:  # whatever the platform's GL raises
        pytest.skip(f"no offscreen rendering here: {error}")
    yield renderer
    renderer.close()


def test_picture_shows_robot_object_and_ghost(renderer):
    far = G1.default_qpos.copy()
    far[2] = -30.0
    empty = renderer.render(far).astype(int).copy()
    robot = renderer.render(G1.default_qpos).astype(int).copy()
    both = renderer.render(G1.default_qpos, POSE).astype(int).copy()
    ghost = G1.default_qpos.copy()
    ghost[1] += 0.5
    ghosted = renderer.render(G1.default_qpos, POSE, ghost_qpos=ghost).astype(int).copy()
    assert robot.shape == (120, 160, 3)
    for before, after in ((empty, robot), (robot, both), (both, ghosted)):
        changed = (np.abs(before - after).sum(-1) > 20).mean()
        assert 0.005 < changed < 0.6


def test_a_robot_without_looks_or_inertial_elements_is_shown(renderer, tmp_path):
    text = G1.mjcf.read_text().replace('group="2"', 'group="3"')
    (tmp_path / "plain.xml").write_text(re.sub(r"<inertial[^>]*/>", "", text))
    plain = replace(G1, name="plain", mjcf=tmp_path / "plain.xml")
    other = type(renderer)(plain, SCENE, width=160, height=120)
    far = G1.default_qpos.copy()
    far[2] = -30.0
    seen = [other.render(qpos).astype(int).copy() for qpos in (far, G1.default_qpos)]
    other.close()
    assert 0.005 < (np.abs(seen[1] - seen[0]).sum(-1) > 20).mean() < 0.6


def test_points_are_shown(renderer):
    plain = renderer.render(G1.default_qpos).astype(int).copy()
    dotted = renderer.render(G1.default_qpos, points=np.array([[0.5, 0.0, 1.0]])).astype(int)
    assert (np.abs(plain - dotted).sum(-1) > 60).any()
