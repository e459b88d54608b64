import numpy as np
import pytest

from omni_envs.demonstrations import load_demonstration
from omni_envs.errors import FileFormatError


def z_up(positions):
    return positions[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


@pytest.fixture
def save(tmp_path):
    def save(name="amass_poses.npz", **arrays):
        np.savez(tmp_path / name, **{k: a for k, a in arrays.items() if a is not None})
        return tmp_path / name

    return save


def test_amass(person, smpl_parameters, write_body, save, tmp_path):
    """120 fps, z up, SMPL-H: joints are where the person's are, hands included."""
    who = person(fps=120.0)
    body = write_body(tmp_path / "bodies/smplh/neutral/model.npz")
    path = save(**smpl_parameters(who), labels=np.array([None, 1], dtype=object))
    demo = load_demonstration(path, body_model=tmp_path / "bodies")
    assert demo.fps == 30 and demo.num_frames == 61 and len(demo.joint_names) == 52
    truth = z_up(who.pose()[0])[::4]
    for ours, smpl in (("Hips", "Pelvis"), ("LeftToe", "L_Foot"), ("RightHand", "R_Wrist")):
        expected = truth[:, who.names.index(ours)]
        found = demo.positions[:, demo.joint_names.index(smpl)]
        np.testing.assert_allclose(found, expected, atol=1e-6)
    assert demo.contact_joints["left_hand"][:2] == ("L_Wrist", "L_Index1")
    assert len(demo.contact_joints["left_hand"]) == 16
    # As tall as the body: from the lowest vertex to the highest.
    rest = who.pose()[0][0]
    assert demo.height == pytest.approx(np.ptp(rest[:, 1]) + 0.06)
    assert load_demonstration(path, body_model=body, height=1.9).height == 1.9
    cut = load_demonstration(path, body_model=body, start=1.0, end=1.5)
    np.testing.assert_allclose(cut.positions, demo.positions[30:45], atol=1e-9)


def test_stage_two_fields_and_a_y_up_world(person, smpl_parameters, write_body, save, tmp_path):
    who = person()
    arrays = smpl_parameters(who)
    poses = arrays["poses"].reshape(who.frames, 52, 3)
    body = write_body(tmp_path / "model.npz")
    rest = arrays["trans"][0] - z_up(who.root)[0]
    parts = {
        "trans": who.root + rest,
        "root_orient": np.zeros((who.frames, 3)),
        "pose_body": poses[:, 1:22].reshape(who.frames, 63),
        "betas": arrays["betas"][None],
        "mocap_frame_rate": np.array(30.0),
        "surface_model_type": np.array("smplh"),
    }
    demo = load_demonstration(save(**parts), body_model=body)
    expected = load_demonstration(save("a.npz", **arrays), body_model=body)
    np.testing.assert_allclose(demo.keypoints, expected.keypoints, atol=1e-6)


def test_a_file_of_body_parts_names_its_model(person, smpl_parameters, write_body, save, tmp_path):
    """Of a folder with several models the one that the file names is taken."""
    arrays = smpl_parameters(person())
    poses = arrays.pop("poses")
    arrays |= {"root_orient": poses[:, :3], "pose_body": poses[:, 3:66]}
    write_body(tmp_path / "bodies/smplh/neutral/model.npz")
    write_body(tmp_path / "bodies/smplx/SMPLX_NEUTRAL.npz", v_template=np.zeros(3))
    path = save(**arrays, surface_model_type=np.array("smplh"))
    assert load_demonstration(path, body_model=tmp_path / "bodies").num_frames == 61
    with pytest.raises(FileFormatError, match=r"SMPLX_NEUTRAL\.npz: v_template"):
        load_demonstration(save(**arrays), body_model=tmp_path / "bodies")


@pytest.mark.parametrize("gender", ["male", b"MALE", ["male"], [b"male"]])
def test_gender_chooses_the_model(person, smpl_parameters, write_body, save, tmp_path, gender):
    arrays = smpl_parameters(person()) | {"gender": np.array(gender)}
    write_body(tmp_path / "smplh/male/model.npz")
    write_body(tmp_path / "smplh/neutral/model.npz", v_template=np.zeros(3))
    path = save(**arrays)
    assert load_demonstration(path, body_model=tmp_path).num_frames == 61


def test_shape_parameters_count(person, smpl_parameters, write_body, save, tmp_path):
    arrays = smpl_parameters(person())
    body = write_body(tmp_path / "model.npz")
    small = load_demonstration(save(**arrays), body_model=body)
    arrays["betas"] = np.array([0.5, *[0.0] * 15])
    tall = load_demonstration(save(**arrays), body_model=body)
    assert tall.height == pytest.approx(1.05 * small.height)


def test_without_a_body_model_the_way_to_one_is_told(person, smpl_parameters, save):
    path = save(**smpl_parameters(person()))
    with pytest.raises(FileFormatError, match=r"option body_model: register at.*accept the lic"):
        load_demonstration(path)


def test_parameters_of_another_model(person, smpl_parameters, write_body, save, tmp_path):
    arrays = smpl_parameters(person())
    arrays["poses"] = np.pad(arrays["poses"], ((0, 0), (0, 9)))
    body = write_body(tmp_path / "model.npz")
    with pytest.raises(FileFormatError, match=r"a smplx model of 55 joints.*found 52"):
        load_demonstration(save(**arrays), body_model=body)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"trans": None}, "arrays: expected trans, and poses"),
        ({"poses": None, "root_orient": np.zeros((61, 3))}, "arrays: expected trans, and poses"),
        ({"poses": np.array([[{}]], dtype=object)}, "arrays: expected trans, and poses"),
        ({"poses": np.zeros((61, 99))}, r"poses: expected 72 \(SMPL\), 156"),
        ({"poses": np.zeros((0, 156))}, "poses: expected numbers"),
        ({"trans": np.zeros((60, 3))}, r"trans: expected numbers \(61, 3\)"),
        ({"betas": np.array([np.nan])}, "betas: expected finite"),
        ({"betas": np.array("x")}, "betas: expected finite"),
        ({"betas": np.zeros(300)}, "shapedirs: expected at least 300"),
        ({"mocap_framerate": None}, "mocap_framerate: expected frames per second, or the option"),
        ({"mocap_framerate": np.array(0.0)}, "mocap_framerate: expected 5 to 1000"),
        ({"mocap_framerate": np.zeros(3)}, "mocap_framerate: expected one number"),
        ({"poses": np.full((61, 156), np.inf)}, "poses: expected finite.*frame 0"),
        ({"trans": np.full((61, 3), np.nan)}, "trans: expected finite"),
    ],
)
def test_bad_files(person, smpl_parameters, write_body, save, tmp_path, change, match):
    arrays = smpl_parameters(person()) | change
    body = write_body(tmp_path / "model.npz")
    with pytest.raises(FileFormatError, match=match):
        load_demonstration(save(**arrays), body_model=body)
