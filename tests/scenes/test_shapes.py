import numpy as np
import pytest
import trimesh

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.scenes import Box, ConvexMesh, Part, load_convex_parts


def test_box_mesh_has_its_volume():
    assert Box((0.1, 0.2, 0.3)).mesh().volume == pytest.approx(8 * 0.1 * 0.2 * 0.3)


@pytest.mark.parametrize("extents", [(0.1, 0.2), (0.0, 1.0, 1.0), (1.0, np.nan, 1.0), (1, -1, 1)])
def test_box_refuses_bad_extents(extents):
    with pytest.raises(InvalidDataError, match="half_extents"):
        Box(extents)


def test_part_mesh_is_posed():
    part = Part(Box((1.0, 0.1, 0.1)), (0.0, 0.0, 5.0), (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    low, high = part.mesh().bounds
    np.testing.assert_allclose(high - low, [0.2, 2.0, 0.2], atol=1e-9)
    np.testing.assert_allclose((low + high) / 2, [0, 0, 5], atol=1e-9)


def test_scaled_convex_mesh():
    box = Box((1.0, 1.0, 1.0)).mesh()
    mesh = ConvexMesh(np.array(box.vertices), np.array(box.faces)).scaled(np.array([1.0, 2.0, 3.0]))
    assert mesh.mesh().volume == pytest.approx(48.0)


def write(path, mesh):
    mesh.export(path)
    return path


def test_two_pieces_are_two_parts(tmp_path):
    a, b = Box((0.1, 0.1, 0.1)).mesh(), Box((0.2, 0.1, 0.1)).mesh().apply_translation([1, 0, 0])
    parts = load_convex_parts(write(tmp_path / "two.obj", trimesh.util.concatenate([a, b])))
    volumes = sorted(p.mesh().volume for p in parts)
    np.testing.assert_allclose(volumes, [0.008, 0.016], rtol=1e-6)


def test_missing_file_names_the_path(tmp_path):
    with pytest.raises(FileFormatError, match=r"absent\.obj"):
        load_convex_parts(tmp_path / "absent.obj")


def test_open_surface_is_refused(tmp_path):
    box = Box((0.1, 0.1, 0.1)).mesh()
    box.update_faces(np.arange(len(box.faces)) > 1)
    with pytest.raises(FileFormatError, match="closed"):
        load_convex_parts(write(tmp_path / "open.obj", box))


def test_concave_piece_is_refused(tmp_path):
    ring = trimesh.creation.torus(0.5, 0.1)
    with pytest.raises(FileFormatError, match="convex"):
        load_convex_parts(write(tmp_path / "ring.obj", ring))


@pytest.mark.parametrize("text", ["", "not a mesh", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"])
def test_files_without_a_solid_are_refused(tmp_path, text):
    path = tmp_path / "bad.obj"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=r"bad\.obj"):
        load_convex_parts(path)


def test_box_mesh_is_recognised_as_a_box_turned_as_little_as_possible(tmp_path):
    turn = trimesh.transformations.rotation_matrix(0.3, [0, 0, 1], [0.1, 0.2, 0.3])
    box = Box((0.1, 0.2, 0.3)).mesh().apply_transform(turn)
    (part,) = load_convex_parts(write(tmp_path / "turned.obj", box))
    np.testing.assert_allclose(part.shape.half_extents, (0.1, 0.2, 0.3), atol=1e-6)
    np.testing.assert_allclose(part.quaternion, [np.cos(0.15), 0, 0, np.sin(0.15)], atol=1e-6)
    np.testing.assert_allclose(part.mesh().centroid, box.centroid, atol=1e-6)


def test_scan_is_thinned_to_its_hull_and_keeps_its_debris(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.2)
    crumb = trimesh.creation.box(extents=[0.004] * 3).apply_translation([0.2, 0, 0])
    path = write(tmp_path / "scan.obj", trimesh.util.concatenate([ball, crumb]))
    (part,) = load_convex_parts(path)
    assert isinstance(part.shape, ConvexMesh)
    assert len(part.shape.vertices) <= 256
    assert part.shape.vertices[:, 0].max() == pytest.approx(0.202, abs=2e-4)
    assert part.mesh().volume == pytest.approx(ball.volume, rel=0.05)
    assert part.mesh().is_watertight
