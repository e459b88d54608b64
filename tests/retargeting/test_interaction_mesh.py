from dataclasses import replace

import numpy as np
import pytest

from omni_envs.retargeting.interaction_mesh import InteractionMesh, connect
from omni_envs.retargeting.surface_points import SurfacePoints, surface_points


def plain_energy(source_points, target_points, simplices_of):
    """The definition: explicit neighbours, explicit Laplacian coordinates, every vertex."""
    from scipy.spatial import Delaunay

    neighbours = [set() for _ in source_points]
    for simplex in Delaunay(simplices_of).simplices:
        for i in simplex:
            neighbours[i] |= set(simplex) - {i}
    total = 0.0
    for i, near in enumerate(neighbours):
        if near:
            near = list(near)
            source = source_points[i] - source_points[near].mean(axis=0)
            target = target_points[i] - target_points[near].mean(axis=0)
            total += float(np.sum((source - target) ** 2))
    return total


def local(points, pose):
    from omni_envs.retargeting.interaction_mesh import rotation_matrices

    return (points - pose[:3]) @ rotation_matrices(pose[3:])


def test_reduced_energy_is_the_definition(grasp):
    mesh = InteractionMesh.of(grasp, 40)
    points = surface_points(grasp, 40)
    rng = np.random.default_rng(0)
    robot = grasp.keypoints + rng.normal(scale=0.05, size=grasp.keypoints.shape)
    energy = mesh.energy(robot)
    for t in (0, 30, 59):
        source = np.vstack([local(grasp.keypoints[t], grasp.source_object_poses[t]), points.source])
        target = np.vstack([local(robot[t], grasp.object_poses[t]), points.target])
        assert energy[t] == pytest.approx(plain_energy(source, target, source), rel=1e-6)


def test_energy_of_the_source_itself_is_zero(grasp):
    points = SurfacePoints(*[surface_points(grasp, 40).source] * 2)
    mesh = InteractionMesh.build(
        grasp.keypoints, points, grasp.source_object_poses, grasp.source_object_poses
    )
    assert np.abs(mesh.energy(grasp.keypoints)).max() < 1e-6


def test_energy_moves_with_the_object(grasp):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([0.3, -0.2, 0.1])
    half = np.sqrt(0.5)
    poses = grasp.object_poses.copy()
    poses[:, :3] = poses[:, :3] @ turn.T + shift
    w, x, y, z = poses[:, 3:].T.copy()
    poses[:, 3:] = half * np.stack([w - z, x - y, y + x, z + w], axis=1)
    moved = InteractionMesh.of(replace(grasp, object_poses=poses), 40)
    robot = grasp.keypoints + 0.01
    np.testing.assert_allclose(
        moved.energy(robot @ turn.T + shift), InteractionMesh.of(grasp, 40).energy(robot), rtol=1e-6
    )


def test_connectivity_is_reused_for_another_target(grasp, monkeypatch):
    from omni_envs.retargeting import interaction_mesh

    made = []
    monkeypatch.setattr(interaction_mesh, "connect", lambda p: made.append(p) or connect(p))
    monkeypatch.setattr(interaction_mesh, "_connectivities", [])
    InteractionMesh.of(grasp, 40)
    InteractionMesh.of(replace(grasp, object_poses=grasp.object_poses + 0.1), 40)
    assert len(made) == 1
    # Not for points that differ by rounding: a motion must not depend on what was made before it.
    InteractionMesh.of(replace(grasp, keypoints=grasp.keypoints * (1.0 + 1e-15)), 40)
    assert len(made) == 2


def test_flat_and_coincident_points_still_connect():
    points = np.random.default_rng(0).random((2, 30, 3))
    points[0, :, 2] = 0.0
    points[1, 5] = points[1, 6]
    connectivity = connect(points)
    for frame in range(2):
        adjacency = connectivity.adjacency(frame)
        np.testing.assert_array_equal(adjacency, adjacency.T)
        assert (adjacency.sum(axis=1) >= 3).sum() >= 29


def test_ground_points_stay_where_they_are_when_the_body_moves_on():
    from omni_envs.retargeting.surface_points import _ground

    centres = np.array([[0.0, 0.0], [0.05, 0.0], [5.0, 5.0], [0.0, 0.0]])
    points = _ground(centres, 0.2)
    np.testing.assert_array_equal(points[0], points[3])
    near = np.linalg.norm(points[0][:, None] - points[1][None], axis=-1).min(axis=1)
    assert np.mean(near < 1e-12) > 0.8
