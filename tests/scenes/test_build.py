import mujoco
import numpy as np
import pytest

from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, PhysicsOptions, Scene, SceneObject, Terrain, build_spec

CRATE = SceneObject("crate", (Part(Box((0.2, 0.15, 0.1))),), mass=1.5, friction=0.7)
SCENE = Scene(CRATE, Terrain((Part(Box((0.5, 0.5, 0.2)), (2.0, 0.0, 0.2)),)))


def test_kinematics_moves_the_object_as_mocap():
    model = build_spec(G1, SCENE).compile()
    assert (model.nq, model.nv, model.nmocap) == (G1.nq, G1.nv, 1)


def test_physics_frees_the_object_last_in_qpos():
    model = build_spec(G1, SCENE, PhysicsOptions()).compile()
    assert (model.nq, model.nv, model.nmocap) == (G1.nq + 7, G1.nv + 6, 0)
    assert int(model.joint("object").qposadr[0]) == G1.nq
    body = model.body("object")
    assert body.mass[0] == pytest.approx(1.5)
    expected = 1.5 / 3 * np.array([0.15**2 + 0.1**2, 0.2**2 + 0.1**2, 0.2**2 + 0.15**2])
    np.testing.assert_allclose(body.inertia, expected, rtol=1e-6)


def test_groups_follow_the_purpose():
    kinematics = build_spec(G1, SCENE).compile()
    physics = build_spec(G1, SCENE, PhysicsOptions(), looks=False).compile()
    assert 5 not in kinematics.geom_group and 4 in kinematics.geom_group
    assert not {2, 4} & set(physics.geom_group.tolist()) and 5 in physics.geom_group


def pairs(model: mujoco.MjModel, data: mujoco.MjData) -> set[frozenset[str]]:
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    return {frozenset(model.geom(int(g)).name for g in c.geom) for c in data.contact[: data.ncon]}


def test_object_rests_on_ground_and_terrain_in_physics_only():
    for physics in (None, PhysicsOptions()):
        model = build_spec(None, SCENE, physics).compile()
        data = mujoco.MjData(model)
        for position, other in (((0, 0, 0.095), "ground"), ((2.0, 0, 0.495), "terrain_0")):
            if physics:
                data.qpos[:3] = position
            else:
                data.mocap_pos[0] = position
            expected = {frozenset(("object_0", other))} if physics else set()
            assert pairs(model, data) == expected


def test_a_crate_dropped_on_the_platform_comes_to_rest_there():
    model = build_spec(None, SCENE, PhysicsOptions()).compile()
    data = mujoco.MjData(model)
    data.qpos[:3] = 2.0, 0.0, 0.55
    mujoco.mj_step(model, data, 200)
    assert data.qpos[2] == pytest.approx(0.5, abs=2e-3)
    assert np.abs(data.qvel).max() < 1e-2


def test_physics_options_are_compiled_in():
    option = build_spec(None, SCENE, PhysicsOptions(0.01, "discrete", 8, 16)).compile().opt
    assert option.timestep == 0.01 and int(option.integrator) == int(
        mujoco.mjtIntegrator.mjINT_DISCRETE
    )
    assert (option.iterations, option.ls_iterations) == (8, 16)
