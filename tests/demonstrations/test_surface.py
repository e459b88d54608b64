import numpy as np
import pytest
import trimesh

from omni_envs.demonstrations import closest_points
from omni_envs.demonstrations.surface import exposed_points
from omni_envs.scenes import Box, ConvexMesh, Part


def box_mesh(half):
    mesh = Box(half).mesh()
    return ConvexMesh(np.array(mesh.vertices), np.array(mesh.faces))


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-0.5, 0.5, (500, 3))


def test_box_by_hand():
    part = Part(Box((0.1, 0.2, 0.3)), (1.0, 0.0, 0.0), (np.sqrt(0.5), 0, 0, np.sqrt(0.5)))
    # Turned by 90° about z: 0.2 along x, 0.1 along y.
    closest, distance = closest_points([part], [[1.3, 0, 0], [1.0, 0.09, 0.0], [1.3, 0.2, 0.3]])
    np.testing.assert_allclose(closest, [[1.2, 0, 0], [1, 0.1, 0], [1.2, 0.1, 0.3]], atol=1e-12)
    np.testing.assert_allclose(distance, [0.1, -0.01, np.hypot(0.1, 0.1)], atol=1e-12)


def test_box_and_its_mesh_agree(points):
    half = (0.15, 0.2, 0.3)
    pose = ((0.1, -0.2, 0.05), (0.5, 0.5, -0.5, 0.5))
    a = closest_points([Part(Box(half), *pose)], points)
    b = closest_points([Part(box_mesh(half), *pose)], points)
    np.testing.assert_allclose(a[1], b[1], atol=1e-9)
    np.testing.assert_allclose(a[0], b[0], atol=1e-9)
    assert (a[1] < 0).any() and (a[1] > 0).any()


def test_round_mesh_against_the_sphere(points):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    part = Part(ConvexMesh(np.array(ball.vertices), np.array(ball.faces)))
    closest, distance = closest_points([part], points)
    radius = np.linalg.norm(points, axis=1)
    np.testing.assert_allclose(distance, radius - 0.3, atol=1e-3)
    outside = distance > 0
    np.testing.assert_allclose(
        np.linalg.norm(points - closest, axis=1), np.abs(distance), atol=1e-9
    )
    np.testing.assert_allclose(
        closest[outside], 0.3 * points[outside] / radius[outside, None], atol=0.02
    )


def test_nearest_part_wins_and_no_parts_is_infinity():
    near, far = Part(Box((0.1, 0.1, 0.1))), Part(Box((0.1, 0.1, 0.1)), (5.0, 0, 0))
    closest, distance = closest_points([far, near], [[0.3, 0, 0]])
    np.testing.assert_allclose(closest, [[0.1, 0, 0]])
    np.testing.assert_allclose(distance, [0.2])
    closest, distance = closest_points([], [[0.3, 0, 0]])
    assert np.isnan(closest).all() and np.isinf(distance).all()


def above(points):
    return np.asarray(points) * (1.0, 1.0, 0.0) + (0.0, 0.0, 9.0)


def test_exposed_is_closest_outside_and_on_the_surface_inside(points):
    parts = (Part(Box((0.15, 0.2, 0.3))), Part(box_mesh((0.2, 0.1, 0.1)), (0.1, 0.1, 0.2)))
    points = points + np.array([0.0, 0.0, 0.5])
    closest, distance = closest_points(parts, points)
    found, signed = exposed_points(parts, points, False, above(points))
    outside = distance >= 0
    np.testing.assert_array_equal(found[outside], closest[outside])
    assert (signed <= distance + 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), np.abs(signed), atol=1e-9)
    # Where it ends is on the surface of the whole, seen from where the point came from.
    np.testing.assert_allclose(closest_points(parts, found)[1][~outside], 0.0, atol=1.1e-3)


def test_a_seam_is_no_surface():
    # Two boxes side by side: the joint is 1 cm from the seam and 5 cm below the top.
    parts = (Part(Box((0.2, 0.2, 0.2)), (-0.2, 0, 0.2)), Part(Box((0.2, 0.2, 0.2)), (0.2, 0, 0.2)))
    point = np.array([[0.01, 0.0, 0.35]])
    found, distance = exposed_points(parts, point, False, above(point))
    np.testing.assert_allclose(found, [[0.01, 0.0, 0.4]], atol=1e-12)
    np.testing.assert_allclose(distance, [-0.05], atol=1e-12)


def test_the_underside_of_a_box_in_the_ground_is_no_surface():
    parts = (Part(Box((0.5, 0.5, 0.04)), (0, 0, 0.0)),)
    point = np.array([[0.0, 0.0, -0.02]])
    found, distance = exposed_points(parts, point, True, above(point))
    np.testing.assert_allclose(found, [[0.0, 0.0, 0.04]], atol=1e-12)
    np.testing.assert_allclose(distance, [-0.06], atol=1e-12)


def test_the_ground_alone():
    points = np.array([[0.0, 1.0, 0.3], [2.0, 0.0, -0.1]])
    found, distance = exposed_points((), points, True, above(points))
    np.testing.assert_allclose(found, points * (1, 1, 0))
    np.testing.assert_allclose(distance, points[:, 2])
