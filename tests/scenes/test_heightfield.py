import mujoco
import numpy as np
import pytest

from omni_envs.errors import InvalidDataError
from omni_envs.scenes import HeightField, PhysicsOptions, Scene, Terrain, build_spec

RNG = np.random.default_rng(1)
FIELD = HeightField(0.3 * RNG.random((9, 13)), (2.4, 1.6), (0.5, -0.2))


def lowest_ball(place, radius):
    """Distance of a small ball at a place to the height field, by MuJoCo."""
    spec = build_spec(None, Scene(terrain=Terrain((), FIELD)))
    body = spec.worldbody.add_body(pos=place)
    body.add_freejoint()
    body.add_geom(size=(radius, 0, 0), contype=1, conaffinity=1, margin=0.2)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    field = model.geom("terrain").id
    return min(c.dist for c in data.contact[: data.ncon] if field in c.geom)


def test_distances_are_those_of_mujoco():
    xy = np.column_stack([RNG.uniform(-0.4, 1.4, 20), RNG.uniform(-0.8, 0.4, 20)])
    places = np.column_stack([xy, FIELD.height_at(xy) + RNG.uniform(0.03, 0.12, 20)])
    closest, distance = FIELD.closest_points(places)
    np.testing.assert_allclose(np.linalg.norm(closest - places, axis=1), distance)
    for place, expected in zip(places, distance, strict=True):
        assert lowest_ball(place, 0.005) + 0.005 == pytest.approx(expected, abs=1e-5)


def test_heights_go_through_the_grid_points_and_are_signed():
    points = FIELD.vertices().reshape(-1, 3)
    np.testing.assert_allclose(FIELD.height_at(points[:, :2]), points[:, 2], atol=1e-9)
    below = FIELD.closest_points(points[[40]] - [0, 0, 0.05])[1]
    assert -0.05 <= below[0] < 0
    closest, distance = FIELD.closest_points(np.array([[9.0, 0, 0]]))
    assert np.isnan(closest).all() and np.isinf(distance).all()
    assert FIELD.height_at(np.array([[9.0, 0.0]])) == -np.inf


def test_scaling_scales_the_surface():
    scaled = FIELD.scaled(np.array([2.0, 0.5, 3.0]))
    np.testing.assert_allclose(scaled.vertices(), FIELD.vertices() * [2.0, 0.5, 3.0])
    assert (scaled.mesh().face_normals[:, 2] > 0).all()


def test_a_ball_rests_on_it():
    bowl = np.array([[(x * x + y * y) * 0.4 for x in np.linspace(-1, 1, 9)]
                     for y in np.linspace(-1, 1, 9)])  # fmt: skip
    scene = Scene(terrain=Terrain((), HeightField(bowl + 0.2, (2.0, 2.0))))
    spec = build_spec(None, scene, PhysicsOptions())
    body = spec.worldbody.add_body(pos=(0.3, 0.2, 0.6))
    body.add_freejoint()
    body.add_geom(size=(0.1, 0, 0), condim=6, friction=(1, 0.01, 0.01))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 4000)
    np.testing.assert_allclose(data.qpos[:3], [0, 0, 0.3], atol=0.03)


@pytest.mark.parametrize(
    ("heights", "size", "position", "field"),
    [
        (np.zeros((1, 5)), (1, 1), (0, 0), "heights"),
        (np.zeros(5), (1, 1), (0, 0), "heights"),
        (np.full((3, 3), np.nan), (1, 1), (0, 0), "heights"),
        (np.zeros((3, 3)), (0, 1), (0, 0), "size"),
        (np.zeros((3, 3)), (1,), (0, 0), "size"),
        (np.zeros((3, 3)), (1, np.inf), (0, 0), "size"),
        (np.zeros((3, 3)), (1, 1), (np.nan, 0), "position"),
    ],
)
def test_bad_fields_are_refused(heights, size, position, field):
    with pytest.raises(InvalidDataError, match=field):
        HeightField(heights, size, position)
