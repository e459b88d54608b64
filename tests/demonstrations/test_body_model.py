import pickle

import numpy as np
import pytest

from omni_envs.demonstrations import body_model
from omni_envs.demonstrations.body_model import load_body_model, pose_joints
from omni_envs.errors import FileFormatError


def test_joints_follow_the_shape(write_body, tmp_path):
    model = load_body_model(write_body(tmp_path / "model.npz"))
    assert model.num_joints == 52
    rest, height = model.rest(np.zeros(10))
    np.testing.assert_allclose(rest[1], [0.1, -0.02, 0.0], atol=1e-12)
    taller, more = model.rest(np.array([1.0]))  # the synthetic body grows by 10 % per unit
    np.testing.assert_allclose(taller, 1.1 * rest)
    assert more == pytest.approx(1.1 * height)
    with pytest.raises(FileFormatError, match="at least 400 shape directions; found 16"):
        model.rest(np.zeros(400))


def test_pose_joints_by_hand():
    rest = np.array([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.0]])
    turns = np.zeros((2, 2, 3))
    turns[1, 0] = [0.0, 0.0, np.pi / 2]  # the root takes −y to +x
    turns[1, 1] = [0.0, 0.0, np.pi / 2]
    joints = pose_joints(rest, (-1, 0, 1), turns, np.array([[0, 0, 0], [1.0, 2.0, 3.0]]))
    np.testing.assert_allclose(joints[0], rest)
    np.testing.assert_allclose(joints[1], [[1, 3, 3], [1.5, 3, 3], [1.5, 3.5, 3]], atol=1e-12)


@pytest.mark.parametrize(
    ("where", "kind", "gender", "found"),
    [
        ("smplh/neutral/model.npz", "smplh", "male", True),
        ("smplh/male/model.npz", "smplh", "male", True),
        ("smplh/male/model.npz", "smplh", None, False),
        ("neutral/model.npz", "smplh", None, True),
        ("SMPLX_NEUTRAL.npz", "smplx", "neutral", True),
        ("smplx/SMPLX_FEMALE.npz", "smplx", "female", True),
        ("smplx/SMPLX_FEMALE.npz", "smplh", "female", False),
        ("smpl/SMPL_NEUTRAL.npz", None, None, True),
    ],
)
def test_models_are_found_in_a_folder(write_body, tmp_path, where, kind, gender, found):
    write_body(tmp_path / where)
    if found:
        assert load_body_model(tmp_path, kind, gender).path == tmp_path / where
    else:
        with pytest.raises(FileFormatError, match=r"body model: expected smpl.*mano\.is\.tue"):
            load_body_model(tmp_path, kind, gender)


def test_pickles_are_never_opened(tmp_path, capsys):
    class Mischief:
        def __reduce__(self):
            return (print, ("this must never run",))

    path = tmp_path / "SMPL_NEUTRAL.pkl"
    path.write_bytes(pickle.dumps(Mischief()))
    with pytest.raises(FileFormatError, match=r"a \.pkl can run code"):
        load_body_model(path)
    renamed = path.rename(tmp_path / "model.npz")
    with pytest.raises(FileFormatError, match="content"):
        load_body_model(renamed)
    assert "never run" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"J_regressor": None}, "arrays: expected an SMPL model.*no J_regressor"),
        ({"J_regressor": np.array([{}], dtype=object)}, "no J_regressor"),
        ({"v_template": np.zeros((5, 3))}, "shapedirs: expected finite numbers for 5 vertices"),
        ({"v_template": np.zeros(())}, "v_template: expected"),
        ({"v_template": np.full((104, 3), np.nan)}, "v_template: expected finite"),
        ({"kintree_table": np.zeros((2, 52), int)}, None),
        ({"kintree_table": np.full((2, 52), 7)}, "kintree_table.*another order"),
        ({"kintree_table": np.zeros((2, 5), int)}, "kintree_table"),
    ],
)
def test_damaged_models(write_body, tmp_path, change, match):
    path = write_body(tmp_path / "model.npz", **change)
    if match is None:
        load_body_model(path)
        return
    with pytest.raises(FileFormatError, match=match):
        load_body_model(path)


def test_missing_model_says_how_to_get_one(tmp_path):
    with pytest.raises(FileFormatError, match=r"register at smpl-x\.is\.tue\.mpg\.de"):
        load_body_model(tmp_path / "absent")
    assert "licence" in body_model.WHERE
