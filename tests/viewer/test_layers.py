import numpy as np
import pytest
from scipy.spatial import Delaunay

from omni_envs import rotations
from omni_envs.demonstrations import builtin_demonstration
from omni_envs.references import cached_reference, reference_from_qpos
from omni_envs.retargeting.surface_points import surface_points
from omni_envs.robots import G1
from omni_envs.viewer.layers import (
    BONES,
    MISSING,
    TOUCHING,
    contact_marks,
    mesh_edges,
    violations,
)


@pytest.fixture(scope="module")
def reference():
    return cached_reference(builtin_demonstration("box_carry"), G1)


def test_bones_join_all_keypoints_once():
    assert len(np.unique(np.sort(BONES, axis=1), axis=0)) == len(BONES)
    assert set(BONES.ravel()) == set(range(15))


def test_edges_of_the_mesh_join_body_and_object(reference):
    frame, source = 300, reference.source
    edges = mesh_edges(source, frame)
    body = source.keypoints[frame]
    at_body = np.linalg.norm(edges[:, :, None] - body, axis=-1).min(axis=2) < 1e-9
    assert at_body.any(axis=1).all()
    others = edges[~at_body]
    half = reference.scene.object.surface().extents / 2  # a box
    pose = reference.object_poses[frame]
    turn = np.broadcast_to(rotations.conjugate(pose[3:]), (len(others), 4))
    local = rotations.rotate(turn, others - pose[:3])
    np.testing.assert_allclose((np.abs(local) / half).max(axis=1), 1.0, atol=1e-6)
    # Between keypoints: those that a Delaunay mesh of body and shrunken object has.
    here = source.source_object_poses[frame]
    turn = np.broadcast_to(rotations.conjugate(here[3:]), (15, 4))
    keypoints = rotations.rotate(turn, body - here[:3])
    points = np.concatenate([keypoints, surface_points(source, 100).source])
    simplices = Delaunay(points).simplices
    pairs = {
        (min(i, j), max(i, j)) for s in simplices for i in s for j in s if i != j and min(i, j) < 15
    }
    assert len(pairs) == len(edges)


def test_marks_say_whether_the_robot_touches_too(reference):
    held = int(np.flatnonzero(reference.contacts["right_hand"])[60])
    marks = contact_marks(reference, held)
    assert len(marks.points) and np.allclose(marks.colours[0], TOUCHING)
    away = reference.qpos.copy()
    away[:, 1] += 2.0
    moved = reference_from_qpos(
        G1,
        reference.fps,
        away,
        reference.object_poses,
        reference.scene,
        reference.contacts,
        reference.stance,
    )
    assert np.allclose(contact_marks(moved, held).colours, MISSING)


def test_violations_name_the_body_that_is_too_deep(reference):
    assert not any(map(len, violations(reference)))
    sunk = reference.qpos[:5].copy()
    sunk[2, 2] -= 0.05
    moved = reference_from_qpos(
        G1, reference.fps, sunk, reference.object_poses[:5], reference.scene
    )
    found = violations(moved)
    assert [len(f) > 0 for f in found] == [False, False, True, False, False]
    names = {moved.body_names[i] for i in found[2]}
    assert names & {"left_ankle_roll_link", "right_ankle_roll_link"}
