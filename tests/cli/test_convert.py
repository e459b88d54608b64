import json
from typing import get_args, get_type_hints

import numpy as np
import pytest

from omni_envs.cli import convert, main
from omni_envs.references import MOTION_FORMATS, Reference, load_motion, reference_from_qpos
from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, SceneObject


@pytest.fixture
def reference(tmp_path):
    qpos = np.tile(G1.default_qpos, (20, 1))
    qpos[:, 0] = np.linspace(0, 0.2, 20)
    poses = np.tile([0.5, 0, 0.3, 1, 0, 0, 0], (20, 1)).astype(float)
    scene = Scene(object=SceneObject("box", (Part(Box((0.1, 0.1, 0.1))),)))
    return reference_from_qpos(G1, 50.0, qpos, poses, scene)


def test_every_format_is_offered():
    offered = get_args(get_type_hints(convert.Convert, vars(convert))["to"])
    assert offered == ("reference", *MOTION_FORMATS)


def test_there_and_back(reference, tmp_path, capsys):
    path = reference.save(tmp_path / "r.npz")
    out = tmp_path / "m.npz"
    assert main(["convert", str(path), "--to", "omniretarget_dataset", "--out", str(out)]) == 0
    assert load_motion(out).format == "omniretarget_dataset"
    mesh = tmp_path / "crate.obj"
    reference.scene.object.surface().export(mesh)
    back = tmp_path / "back.npz"
    words = ["convert", str(out), "--to", "reference", "--object", str(mesh), "--out", str(back)]
    capsys.readouterr()
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frames"] == 20
    again = Reference.load(back)
    np.testing.assert_array_equal(again.qpos, reference.qpos)
    np.testing.assert_array_equal(again.object_poses, reference.object_poses)
    assert again.scene.object.name == "crate"
    assert again.report is not None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["m.npz", "--to", "reference", "--out", "x.npz"], "scene (or demonstration)"),
        (["r.npz", "--to", "mjlab", "--fps", "30", "--out", "x.npz"], "fps: the reference"),
        (["r.npz", "--to", "unitree_csv", "--out", "x.csv"], "no place for the object"),
        (["r.npz", "--to", "reference", "--out", "x.csv"], "must end in .npz"),
        (["none.npz", "--to", "mjlab", "--out", "x.npz"], "none.npz"),
    ],
)
def test_what_cannot_be_done_leaves_nothing(
    reference, words, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    reference.save("r.npz")
    main(["convert", "r.npz", "--to", "holosoma_retargeter", "--out", "m.npz"])
    assert main(["convert", *words]) == 1
    assert message in capsys.readouterr().err
    assert {p.name for p in tmp_path.iterdir()} == {"r.npz", "m.npz"}
