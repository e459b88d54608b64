"""Randomization changes the compiled physics, in the right range, and only there."""

import mujoco
import numpy as np
import pytest

from omni_envs.robots import G1

TORSO, OBJECT = "torso_link", "object"


def models(env):
    return [env.simulation.model_of(i) for i in range(env.num_envs)]


def only(**randomization):
    off = {"torso_centre_of_mass": None, "joint_default": 0.0, "push": None, "object": None}
    return {"randomization": off | randomization}


def only_object(**parts):
    off = {"mass": None, "centre_of_mass": 0.0, "inertia": None, "shape": 0.0}
    return only(object=off | parts)


def changed_bodies(env, field):
    base = env.simulation.model
    names = set()
    for model in models(env):
        different = np.asarray(getattr(model, field)) != np.asarray(getattr(base, field))
        rows = np.flatnonzero(different.reshape(base.nbody, -1).any(axis=1))
        names |= {base.body(int(i)).name for i in rows}
    return names


def spread(values, low, high):
    values = np.asarray(values)
    assert (values >= low - 1e-9).all()
    assert (values <= high + 1e-9).all()
    quantiles = (np.quantile(values, [0.1, 0.5, 0.9]) - low) / (high - low)
    np.testing.assert_allclose(quantiles, [0.1, 0.5, 0.9], atol=0.12)


@pytest.fixture
def started(make):
    def factory(num_envs=200, **options):
        env = make(num_envs, **options)
        env.reset(seed=1)
        return env

    return factory


def test_without_randomization_all_models_are_the_same(started, quiet):
    env = started(3, **quiet)
    for model in models(env):
        for field in ("body_mass", "body_ipos", "body_inertia", "geom_size", "dof_invweight0"):
            expected = getattr(env.simulation.model, field)
            np.testing.assert_array_equal(getattr(model, field), expected)


OFF = {"mass": None, "centre_of_mass": 0.0, "inertia": None, "shape": 0.0}
DERIVED = {
    "actuator_acc0", "body_invweight0", "body_sameframe", "body_subtreemass", "bvh_aabb", "dof_M0",
    "dof_invweight0", "dof_length", "geom_aabb", "geom_rbound",
}  # fmt: skip
"""What the compiler and ``mj_setConst`` make of the other fields."""


@pytest.mark.parametrize(
    ("randomization", "fields"),
    [
        ({"torso_centre_of_mass": (0.025, 0.05, 0.075)}, {"body_ipos"}),
        ({"friction": (0.3, 1.2)}, {"geom_friction"}),
        ({"object": OFF | {"mass": (0.1, 2.0)}}, {"body_mass", "body_inertia"}),
        ({"object": OFF | {"centre_of_mass": 0.08}}, {"body_ipos"}),
        ({"object": OFF | {"inertia": (0.5, 1.5)}}, {"body_inertia"}),
        ({"object": OFF | {"shape": 0.1}}, {"geom_size", "body_inertia", "body_iquat"}),
    ],
    ids=lambda v: "-".join(sorted(v)),
)
def test_nothing_else_of_the_model_changes(started, randomization, fields):
    env = started(20, **only(**randomization))
    base, changed, rows = env.simulation.model, set(), set()
    dofs = slice(-6, None) if "object" in randomization else slice(None)
    for model in models(env):
        for name in mujoco.batch.MODEL_FIELDS:
            value, was = getattr(model, name, None), getattr(base, name, None)
            if isinstance(value, np.ndarray) and not np.array_equal(value, was):
                changed.add(name)
                different = (value != was).reshape(len(value), -1).any(axis=1)
                if name in fields and name.startswith("body_"):
                    rows |= {base.body(int(i)).name for i in np.flatnonzero(different)}
                if name == "dof_M0":
                    assert different[dofs].any() and different.sum() == different[dofs].sum()
    assert changed - DERIVED == fields
    assert rows <= ({OBJECT} if "object" in randomization else {TORSO})


def test_models_of_another_seed_are_others(started):
    one, two, other = (started(1, randomization={"seed": s}) for s in (0, 0, 1))
    masses = [e.simulation._variants.fields["body_mass"][:, -1] for e in (one, two, other)]
    np.testing.assert_array_equal(masses[0], masses[1])
    assert not set(masses[0]) & set(masses[2])


def test_torso_centre_of_mass(started):
    env = started(**only(torso_centre_of_mass=(0.025, 0.05, 0.075)))
    assert changed_bodies(env, "body_ipos") == {TORSO}
    base = env.simulation.model.body(TORSO).ipos
    offsets = np.array([m.body(TORSO).ipos - base for m in models(env)])
    for axis, half in enumerate((0.025, 0.05, 0.075)):
        spread(offsets[:, axis], -half, half)
    assert not changed_bodies(env, "body_mass")


def test_derived_constants_are_those_of_a_fresh_computation(started):
    env = started(4)
    for model in models(env):
        fresh = env.simulation.model_of(0)
        for field in ("body_ipos", "body_iquat", "body_mass", "body_inertia", "geom_size"):
            getattr(fresh, field)[:] = getattr(model, field)
        mujoco.mj_setConst(fresh, mujoco.MjData(fresh))
        for field in ("body_subtreemass", "dof_invweight0", "body_invweight0", "dof_M0"):
            np.testing.assert_allclose(getattr(model, field), getattr(fresh, field), rtol=1e-12)


def test_object_mass(started):
    env = started(**only_object(mass=(0.1, 2.0)))
    assert changed_bodies(env, "body_mass") == {OBJECT}
    masses = np.array([m.body(OBJECT).mass[0] for m in models(env)])
    spread(masses, 0.1, 2.0)
    # The inertia of the same shape goes with the mass.
    base = env.simulation.model.body(OBJECT)
    for model, mass in zip(models(env)[:5], masses, strict=False):
        expected = np.sort(base.inertia) * mass / base.mass[0]
        np.testing.assert_allclose(np.sort(model.body(OBJECT).inertia), expected)


def test_object_centre_of_mass(started):
    env = started(**only_object(centre_of_mass=0.08))
    assert changed_bodies(env, "body_ipos") == {OBJECT}
    offsets = np.array([m.body(OBJECT).ipos for m in models(env)])
    for axis in range(3):
        spread(offsets[:, axis], -0.08, 0.08)


def test_object_inertia_scales_as_a_whole(started):
    env = started(**only_object(inertia=(0.5, 1.5)))
    assert changed_bodies(env, "body_inertia") == {OBJECT}
    base = np.sort(env.simulation.model.body(OBJECT).inertia)
    factors = np.array([np.sort(m.body(OBJECT).inertia) / base for m in models(env)])
    np.testing.assert_allclose(factors, np.broadcast_to(factors[:, :1], factors.shape))
    spread(factors[:, 0], 0.5, 1.5)


def test_object_shape(started):
    env = started(**only_object(shape=0.1))
    base = env.simulation.model
    geom = base.geom("object_0").id
    sizes = np.array([m.geom_size[geom] for m in models(env)]) / base.geom_size[geom]
    for axis in range(3):
        spread(sizes[:, axis], 0.9, 1.1)
    for model in models(env)[:5]:
        others = np.arange(model.ngeom) != geom
        np.testing.assert_array_equal(model.geom_size[others], base.geom_size[others])
        assert model.geom_rbound[geom] == pytest.approx(np.linalg.norm(model.geom_size[geom]))
        h, mass = model.geom_size[geom], model.body(OBJECT).mass[0]
        solid = mass / 3 * (np.sum(h**2) - h**2)
        np.testing.assert_allclose(np.sort(model.body(OBJECT).inertia), np.sort(solid), rtol=1e-6)


def test_a_wider_box_is_touched_where_it_is_wider(started):
    """The compiled physics follows: a box dropped on the ground rests on its own half height."""
    env = started(6, **only_object(shape=0.1), preset="paper")
    geom = env.simulation.model.geom("object_0").id
    env.simulation.qpos[:, 36:43] = [3.0, 0, 0.2, 1, 0, 0, 0]
    env.simulation.qvel[:, 35:] = 0
    for _ in range(60):
        env.simulation.step()
    heights = np.array([m.geom_size[geom, 2] for m in models(env)])
    assert np.ptp(heights) > 0.002
    np.testing.assert_allclose(env.simulation.qpos[:, 38], heights, atol=2e-3)


def test_shape_of_a_mesh(started, sway):
    env = started(40, **only_object(shape=0.1), reference=sway(mesh=True))
    base = env.simulation.model
    geom = base.geom("object_0").id
    factors = np.array([m.geom_rbound[geom] for m in models(env)]) / base.geom_rbound[geom]
    assert factors.min() < 0.94
    assert factors.max() > 1.06
    assert (np.abs(factors - 1) <= 0.1 + 1e-6).all()
    masses = [m.body(OBJECT).mass[0] for m in models(env)]
    np.testing.assert_allclose(masses, 1.0, rtol=1e-9)


def test_robot_friction(started):
    env = started(**only(friction=(0.3, 1.2)))
    model = env.simulation.model
    robot = np.array(
        [model.body(int(b)).name in G1.body_names for b in np.asarray(model.geom_bodyid)]
    )
    drawn = np.array([m.geom_friction[robot, 0] for m in models(env)])
    np.testing.assert_array_equal(drawn, np.broadcast_to(drawn[:, :1], drawn.shape))
    spread(drawn[:, 0], 0.3, 1.2)
    for m in models(env)[:5]:
        np.testing.assert_array_equal(m.geom_friction[~robot], model.geom_friction[~robot])


def test_an_episode_keeps_its_variant_and_the_next_gets_another(make):
    env = make(50)
    env.reset(seed=0)
    before = env.simulation.variant.copy()
    done = np.zeros(50, bool)
    for _ in range(30):
        _, _, terminated, truncated, _ = env.step(np.zeros((50, 29)))
        done |= terminated | truncated
    assert done.any()
    same = env.simulation.variant == before
    assert same[~done].all()
    assert same[done].mean() < 0.2
