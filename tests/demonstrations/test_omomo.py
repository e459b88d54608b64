import numpy as np
import pytest
import trimesh

from omni_envs.demonstrations import load_demonstration
from omni_envs.demonstrations.omomo import CONVERSION
from omni_envs.errors import FileFormatError


def z_up(positions):
    return positions[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


@pytest.fixture
def sequence(person, smpl_parameters, write_body, tmp_path):
    """One entry of OMOMO's pickle, as the conversion writes it."""
    who = person()
    arrays = smpl_parameters(who)
    body = np.load(write_body(tmp_path / "body.npz"))
    rest = 0.5 * (body["v_template"][:52] + body["v_template"][52:])
    parents = body["kintree_table"][0].astype(int)
    offsets = rest[:24].copy()
    offsets[1:] -= rest[parents[1:24]]
    half = np.pi / 4
    turn = np.array([[np.cos(half), -np.sin(half), 0], [np.sin(half), np.cos(half), 0], [0, 0, 1]])
    # trans is that of a body model whose root joint is not at its origin.
    return who, {
        "seq_name": np.array("sub3_largebox_003"),
        "betas": np.zeros((1, 16)),
        "gender": np.array("male"),
        "trans": np.add(z_up(who.root), [0.01, 0.2, -0.03]),
        "trans2joint": np.array([0.01, 0.2, -0.03]),
        "rest_offsets": offsets,
        "root_orient": arrays["poses"][:, :3],
        "pose_body": arrays["poses"][:, 3:66],
        "obj_trans": np.tile([[[1.0], [0.5], [0.2]]], (who.frames, 1, 1)),
        "obj_rot": np.tile(turn, (who.frames, 1, 1)),
        "obj_scale": np.full(who.frames, 0.5),
    }


def save(folder, arrays, name="sub3_largebox_003.npz"):
    np.savez(folder / name, **{k: a for k, a in arrays.items() if a is not None})
    return folder / name


def test_a_sequence(sequence, tmp_path):
    who, arrays = sequence
    demo = load_demonstration(save(tmp_path, arrays))
    assert demo.fps == 30 and demo.height == 1.9411 and demo.scene.object.name == "largebox"
    truth = z_up(who.pose()[0])
    for ours, smpl in (("Hips", "Pelvis"), ("LeftToe", "L_Foot"), ("RightHand", "R_Wrist")):
        found = demo.positions[:, demo.joint_names.index(smpl)]
        np.testing.assert_allclose(found, truth[:, who.names.index(ours)], atol=1e-6)
    half = np.pi / 8
    expected = [1.0, 0.5, 0.2, np.cos(half), 0, 0, np.sin(half)]
    np.testing.assert_allclose(demo.object_poses, np.tile(expected, (who.frames, 1)), atol=1e-9)


def test_the_body_model_gives_the_same_joints(sequence, tmp_path):
    who, arrays = sequence
    rest = np.load(tmp_path / "body.npz")["v_template"]
    root = 0.5 * (rest[0] + rest[52])
    arrays["trans"] = z_up(who.root) - root
    path = save(tmp_path, arrays, "sub99_largebox_1.npz")
    demo = load_demonstration(path, body_model=tmp_path / "body.npz")
    arrays["trans2joint"] = -root
    other = load_demonstration(save(tmp_path, arrays))
    np.testing.assert_allclose(demo.keypoints, other.keypoints, atol=1e-6)
    assert demo.height == pytest.approx(np.ptp(rest[:, 1]))


def test_the_mesh_beside_is_scaled(sequence, tmp_path):
    _, arrays = sequence
    trimesh.creation.box(extents=[0.6, 0.8, 1.0]).export(tmp_path / "suitcase.obj")
    demo = load_demonstration(save(tmp_path, arrays, "sub4_suitcase_007.npz"))
    np.testing.assert_allclose(
        demo.scene.object.parts[0].shape.half_extents, (0.15, 0.2, 0.25), atol=1e-6
    )
    with pytest.raises(FileFormatError, match=r"object_mesh=.*lamp\.obj"):
        load_demonstration(save(tmp_path, arrays, "sub4_lamp_007.npz"))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"rest_offsets": None}, "arrays: expected bones, or the option body_model"),
        ({"rest_offsets": np.zeros((5, 3))}, "rest_offsets: expected finite offsets"),
        ({"rest_offsets": np.zeros((24, 3))}, "joint positions: expected legs with a length"),
        ({"trans2joint": np.array([np.nan] * 3)}, "trans2joint: expected finite"),
        ({"obj_rot": None}, "arrays: expected obj_trans, obj_rot, obj_scale; found no obj_rot"),
        ({"obj_rot": np.zeros((61, 3, 3))}, "obj_rot: expected rotation matrices"),
        ({"obj_trans": np.zeros((5, 3))}, "obj_trans: expected finite numbers, 3 per frame"),
        ({"obj_scale": np.zeros(61)}, "obj_scale: expected a positive factor"),
        ({"pose_body": np.zeros((61, 60))}, r"pose_body: expected numbers \(61, 63\)"),
    ],
)
def test_bad_files(sequence, tmp_path, change, match):
    path = save(tmp_path, sequence[1] | change)
    with pytest.raises(FileFormatError, match=match) as error:
        load_demonstration(path)
    assert str(path) in str(error.value)


def test_the_conversion_is_python_that_makes_such_files():
    code = CONVERSION.split('"', 1)[1].rsplit('"', 1)[0]
    compile(code, "conversion", "exec")
    assert "np.savez(s['seq_name'] + '.npz', **s)" in code
