import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from omni_envs.robots import G1


def test_bodies_equal_a_full_forward_pass(make):
    env = make(6)
    env.reset(seed=0)
    for action in np.random.default_rng(0).normal(size=(5, 6, 29)):
        env.step(action)
    simulation = env.simulation
    bodies = simulation.bodies()
    for i in range(6):
        model, data = simulation.model_of(i), mujoco.MjData(simulation.model)
        data.qpos[:], data.qvel[:] = simulation.qpos[i], simulation.qvel[i]
        mujoco.mj_forward(model, data)
        for k, name in enumerate(G1.tracked_bodies):
            body = model.body(name).id
            np.testing.assert_allclose(bodies.position[i, k], data.xpos[body], atol=1e-12)
            np.testing.assert_allclose(bodies.quaternion[i, k], data.xquat[body], atol=1e-12)
            velocity = np.zeros(6)
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
            np.testing.assert_allclose(bodies.angular_velocity[i, k], velocity[:3], atol=1e-10)
            np.testing.assert_allclose(bodies.linear_velocity[i, k], velocity[3:], atol=1e-10)


def test_bodies_of_some_are_rows_of_all(make):
    env = make(5)
    env.reset(seed=0)
    ids = np.array([1, 4])
    for part, rows in zip(env.simulation.bodies(), env.simulation.bodies(ids), strict=True):
        np.testing.assert_array_equal(rows, part[ids])


def test_contact_forces_are_the_largest_of_every_substep(make, quiet):
    """Legs driven through each other: the history holds what stepping one by one shows."""
    env = make(2, **quiet)
    env.reset(seed=0, options={"frame": 0})
    simulation = env.simulation
    target = G1.default_joint_array.copy()
    for side, sign in (("left", -1), ("right", 1)):
        joint = G1.joint_names.index(f"{side}_hip_roll_joint")
        target[joint] = sign * 1.0
        simulation.qpos[:, 7 + joint] = sign * 0.1
    single = Batch(simulation.model, 1, 1)
    data = single.bind("sensordata")
    simulation.ctrl[:] = target
    felt = 0.0
    for _ in range(20):
        for name in ("qpos", "qvel", "ctrl", "qacc_warmstart"):
            single.bind(name)[0] = simulation.batch.bind(name)[0]
        simulation.step()
        forces = simulation.contact_forces()
        assert forces.shape == (2, len(data[0]) // 3, 4, 3)
        for substep in range(4):
            single.step()
            expected = data[0].reshape(-1, 3)
            np.testing.assert_allclose(forces[0, :, substep], expected, atol=1e-9)
        felt = max(felt, np.linalg.norm(forces, axis=-1).max())
    assert felt > 10.0


def test_no_self_contact_in_the_default_pose(make, quiet):
    env = make(1, **quiet)
    env.reset(options={"frame": 0})
    env.simulation.ctrl[:] = G1.default_joint_array
    for _ in range(10):
        env.simulation.step()
        assert not env.simulation.contact_forces().any()


def test_an_explosion_is_noticed(make, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the warning into the working directory
    env = make(3)
    env.reset(seed=0)
    env.simulation.qvel[1] = 1e12
    assert env.simulation.step().tolist() == [False, True, False]
    assert env.simulation.before(1)["qvel"] == pytest.approx(1e12)
    assert env.simulation.step().tolist() == [False, True, False]  # until it is reset
    env.reset(seed=0)
    assert not env.simulation.step().any()


def test_a_simulation_that_blows_up_in_the_last_substep_leaves_no_nan(make, monkeypatch):
    env = make(2)
    env.reset(seed=0)
    simulation = env.simulation
    state = simulation.qpos[1].copy()
    real = simulation.batch.step

    def step(**arguments):
        real(**arguments)
        simulation.qpos[1], simulation.qvel[1] = np.nan, np.inf

    monkeypatch.setattr(simulation, "batch", Spoilt(simulation.batch, step))
    observations, _, terminated, _, infos = env.step(np.zeros((2, 29)))
    assert infos["diverged"].tolist() == [False, True]
    assert terminated[1]
    assert np.isfinite(observations).all()
    assert np.isfinite(infos["final_obs"][1]).all()
    assert np.isfinite(infos["error/body_position"]).all()
    np.testing.assert_array_equal(env.divergences[0].qpos, state)


class Spoilt:
    """A batch whose step ends badly."""

    def __init__(self, batch, step):
        self.step, self._batch = step, batch

    def __getattr__(self, name):
        return getattr(self._batch, name)
