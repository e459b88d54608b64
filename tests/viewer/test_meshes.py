from dataclasses import replace

import mujoco
import numpy as np
import pytest

from omni_envs.robots import G1, get_robot
from omni_envs.viewer.meshes import geom_mesh, robot_meshes

SHAPES = """
<mujoco>
  <asset><mesh name="m" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>
  <worldbody>
    <geom type="sphere" size="0.3"/>
    <geom type="ellipsoid" size="0.3 0.2 0.1"/>
    <geom type="capsule" size="0.1 0.2"/>
    <geom type="cylinder" size="0.1 0.2"/>
    <geom type="box" size="0.1 0.2 0.3" pos="1 2 3" euler="0 0 90"/>
    <geom type="mesh" mesh="m"/>
    <geom type="plane" size="1 1 1"/>
  </worldbody>
</mujoco>
"""


def test_shapes_have_their_volume_and_place():
    model = mujoco.MjModel.from_xml_string(SHAPES)
    pi = np.pi
    volumes = [
        4 / 3 * pi * 0.3**3, 4 / 3 * pi * 0.3 * 0.2 * 0.1,
        pi * 0.1**2 * 0.4 + 4 / 3 * pi * 0.1**3, pi * 0.1**2 * 0.4, 8 * 0.1 * 0.2 * 0.3, 1 / 6,
    ]  # fmt: skip
    for geom, volume in enumerate(volumes):
        mesh = geom_mesh(model, geom)
        assert mesh.volume == pytest.approx(volume, rel=0.07)
    box = geom_mesh(model, 4)
    np.testing.assert_allclose(box.bounds, [[0.8, 1.9, 2.7], [1.2, 2.1, 3.3]], atol=1e-6)
    tetrahedron = geom_mesh(model, 5)
    np.testing.assert_allclose(np.sort(tetrahedron.extents), [1, 1, 1], atol=1e-6)
    with pytest.raises(ValueError, match="PLANE"):
        geom_mesh(model, 6)


@pytest.mark.parametrize("name", ["g1", "h1", "t1"])
def test_every_visible_body_of_a_robot_has_a_mesh(name):
    robot = get_robot(name)
    meshes = robot_meshes(robot)
    assert set(meshes) <= set(robot.body_names) and len(meshes) > robot.num_joints // 2
    for parts in meshes.values():
        for colour, mesh in parts:
            assert len(colour) == 4 and len(mesh.faces) and mesh.volume > 0


def test_a_robot_without_looks_is_seen_by_what_collides(tmp_path):
    (tmp_path / "plain.xml").write_text(G1.mjcf.read_text().replace('group="2"', 'group="3"'))
    plain = replace(G1, name="plain", mjcf=tmp_path / "plain.xml")
    assert set(robot_meshes(plain)) >= set(robot_meshes(G1))


def test_robot_is_as_tall_as_it_stands():
    data = mujoco.MjData(G1.model)
    data.qpos[:] = G1.default_qpos
    mujoco.mj_kinematics(G1.model, data)
    heights = []
    for body, parts in robot_meshes(G1).items():
        place = data.body(body)
        for _, mesh in parts:
            heights.append((mesh.vertices @ place.xmat.reshape(3, 3).T + place.xpos)[:, 2])
    heights = np.concatenate(heights)
    assert abs(heights.min()) < 0.01 and 1.2 < heights.max() < 1.4
