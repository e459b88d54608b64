import mujoco
import numpy as np
import pytest
import trimesh

from omni_envs.robots import G1
from omni_envs.robots.self_collision import resting_pairs
from omni_envs.rotations import conjugate, rotate
from omni_envs.scenes import ConvexMesh, Part, Scene, SceneObject, distance_spec

MESH = trimesh.creation.box(extents=(0.5, 0.4, 0.3))
THING = SceneObject("thing", (Part(ConvexMesh(MESH.vertices, MESH.faces)),))
REACH = 0.02


@pytest.fixture(scope="module")
def model():
    return distance_spec(G1, Scene(object=THING), REACH, 0.01).compile()


def is_surroundings(model, geom):
    return model.body(int(model.geom_bodyid[geom])).name in ("world", "object")


def test_distances_to_a_mesh_are_exact(model):
    """With several contacts per pair 1 pose in 700 of a capsule on a box is millimetres off."""
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    hand, part = model.geom("right_finger_hull").id, model.geom("object_0").id
    half, touching = 0.5 * MESH.extents, 0
    data.qpos[:], data.qpos[2] = G1.default_qpos, 2.0
    mujoco.mj_kinematics(model, data)
    along = np.linspace(-1.0, 1.0, 2001)[:, None] * model.geom_size[hand, 1]
    for _ in range(3000):
        turn = rng.normal(size=4)
        data.mocap_quat[0] = turn / np.linalg.norm(turn)
        local = rng.uniform(-1.2, 1.2, 3) * half
        data.mocap_pos[0] = data.geom_xpos[hand] - rotate(data.mocap_quat[0], local)
        mujoco.mj_kinematics(model, data)
        # The capsule is what is within its radius of a line.
        line = data.geom_xpos[hand] + along * data.geom_xmat[hand].reshape(3, 3)[:, 2]
        line = rotate(conjugate(data.mocap_quat), line - data.mocap_pos)
        beyond = np.maximum(np.abs(line) - half, 0.0)
        distance = np.linalg.norm(beyond, axis=1).min() - model.geom_size[hand, 0]
        if not -0.8 * model.geom_size[hand, 0] < distance < 0.9 * REACH:
            continue  # the line itself is inside, or nothing is found
        mujoco.mj_collision(model, data)
        pair = (np.sort(data.contact.geom, axis=1) == sorted((hand, part))).all(axis=1)
        assert data.contact.dist[pair].min() == pytest.approx(distance, abs=1e-5)
        touching += 1
    assert touching > 500


def test_margins_add_up_to_the_distances_asked_for(model):
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    for geom in np.flatnonzero(collides):
        expected = REACH - 0.005 if is_surroundings(model, geom) else 0.005
        assert model.geom_margin[geom] == pytest.approx(expected)


def test_what_touches_at_rest_is_left_out(model):
    pairs = set()
    for signature in model.exclude_signature.tolist():
        first, second = signature >> 16, signature & 0xFFFF
        pairs.add(frozenset((model.body(first).name, model.body(second).name)))
    assert {frozenset(pair) for pair in resting_pairs(G1)} <= pairs
