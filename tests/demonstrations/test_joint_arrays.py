import numpy as np
import pytest
import trimesh

from omni_envs.demonstrations import load_demonstration
from omni_envs.errors import FileFormatError


def z_up(positions):
    return positions[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])


@pytest.fixture
def save(tmp_path):
    def save(name="clip.npz", **arrays):
        np.savez(tmp_path / name, **arrays)
        return tmp_path / name

    return save


def complete(who, **changed):
    arrays = {"positions": who.pose()[0], "fps": who.fps, "joint_names": np.array(who.names)}
    arrays.update(changed)
    return {name: array for name, array in arrays.items() if array is not None}


@pytest.mark.parametrize(("unit", "fps", "dtype"), [(1.0, 30, "f4"), (0.01, 120, "f8")])
def test_named_positions(person, save, unit, fps, dtype):
    who = person(fps=float(fps))
    truth = z_up(who.pose()[0])
    stored = (who.pose()[0] / unit).astype(dtype)
    demo = load_demonstration(save(**complete(who, positions=stored, height=1.8)))
    assert demo.fps == 30 and demo.num_frames == 61 and demo.height == 1.8
    assert demo.joint_names == who.names
    np.testing.assert_allclose(demo.positions, truth[:: fps // 30], atol=1e-6)
    again = load_demonstration(save(**complete(who, positions=stored)), start=1.0)
    assert again.num_frames == 31 and again.height == pytest.approx(0.85 / 0.491, rel=1e-4)


def test_the_layout_of_holosoma(person, save, tmp_path):
    """``global_joint_positions`` and ``height`` without names or frame rate; and bare ``.npy``."""
    who = person()
    path = save(global_joint_positions=who.pose()[0], height=np.array(1.7))
    with pytest.raises(FileFormatError, match=r"fps.*the option fps"):
        load_demonstration(path)
    demo = load_demonstration(path, fps=30.0)
    assert demo.height == 1.7 and demo.joint_names == who.names  # 22 joints: LAFAN1 or SMPL?
    np.save(tmp_path / "clip.npy", who.pose()[0])
    bare = load_demonstration(tmp_path / "clip.npy", fps=30.0)
    np.testing.assert_array_equal(bare.positions, demo.positions)
    assert load_demonstration(tmp_path / "clip.npy", fps=30.0, skeleton="lafan1").fps == 30
    with pytest.raises(FileFormatError, match=r"joints of left_|unit of length|left and right"):
        load_demonstration(tmp_path / "clip.npy", fps=30.0, skeleton="smpl")


def test_an_order_told_in_yaml(person, tmp_path):
    who = person()
    np.save(tmp_path / "clip.npy", who.pose()[0][:, ::-1])
    with pytest.raises(FileFormatError, match="joint names, or the option skeleton"):
        load_demonstration(tmp_path / "clip.npy", fps=30.0)
    keypoints = {
        "pelvis": "Hips",
        **{
            f"{s}_{limb}": f"{s.capitalize()}{joint}"
            for s in ("left", "right")
            for limb, joint in (
                ("hip", "UpLeg"), ("knee", "Leg"), ("ankle", "Foot"), ("toe", "Toe"),
                ("shoulder", "Arm"), ("elbow", "ForeArm"), ("hand", "Hand"),
            )
        },
    }  # fmt: skip
    lines = ["keypoints:", *(f"  {k}: {j}" for k, j in keypoints.items())]
    lines += ["joint_names:", *(f"  - {name}" for name in reversed(who.names))]
    (tmp_path / "map.yaml").write_text("\n".join(lines))
    demo = load_demonstration(tmp_path / "clip.npy", fps=30.0, skeleton=tmp_path / "map.yaml")
    assert demo.joint_names == who.names[::-1]


def test_an_object_comes_along(person, save, tmp_path):
    who = person(fps=60.0)
    trimesh.creation.box(extents=[0.3, 0.4, 0.5]).export(tmp_path / "box.obj")
    poses = np.tile([1.0, 0.0, 0.25, 1.0, 0.0, 0.0, 0.0], (who.frames, 1))
    poses[:, 0] += np.arange(who.frames) * 0.01
    path = save(**complete(who, positions=z_up(who.pose()[0]), object_poses=poses))
    with pytest.raises(FileFormatError, match=r"object_poses.*object_mesh"):
        load_demonstration(path)
    demo = load_demonstration(path, object_mesh=tmp_path / "box.obj", start=0.5)
    np.testing.assert_allclose(demo.object_poses, poses[30::2])
    assert demo.scene.object.name == "box"
    bad = poses.copy()
    bad[4, 3:] = 0
    with pytest.raises(FileFormatError, match=r"object_poses.*unit quaternions"):
        load_demonstration(
            save(**complete(who, object_poses=bad)), object_mesh=tmp_path / "box.obj"
        )


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"positions": None}, "arrays: expected joint positions|arrays: expected positions"),
        ({"positions": np.zeros((0, 22, 3))}, r"positions: expected shape.*\(0, 22, 3\)"),
        ({"positions": np.zeros((5, 22))}, r"positions: expected shape"),
        ({"positions": np.full((5, 22, 3), "x")}, "positions: expected numbers"),
        ({"positions": np.zeros((5, 22, 3))}, "joint positions: expected legs with a length"),
        (
            {"fps": None},
            "fps: expected frames per second, or the option fps .--fps-source.; found none",
        ),
        ({"fps": 0.0}, "fps: expected a positive number; found 0"),
        ({"fps": np.nan}, "fps: expected a positive number"),
        ({"fps": 1e6}, "fps: expected 5 to 1000 frames per second"),
        ({"fps": np.array([30.0, 30.0])}, "fps: expected one number"),
        ({"joint_names": np.array(["a"])}, "joint_names: expected 22 names"),
        ({"joint_names": np.arange(22)}, "joint_names: expected 22 names"),
        ({"joint_names": np.array(["Hips"] * 22)}, "joint_names: expected names that differ"),
        ({"height": -1.0}, "height: expected a positive number"),
        ({"height": 17.0}, "height: expected 0 to 3 m; found 17 m"),
    ],
)
def test_bad_archives(person, save, change, match):
    path = save(**complete(person(), **change))
    with pytest.raises(FileFormatError, match=match) as error:
        load_demonstration(path)
    assert str(path) in str(error.value)


def test_nan_names_the_frame(person, save):
    who = person(fps=60.0)
    positions = who.pose()[0]
    positions[42, 3, 1] = np.nan
    path = save(**complete(who, positions=positions))
    with pytest.raises(FileFormatError, match=r"positions: expected finite.*frame 42"):
        load_demonstration(path)
    assert load_demonstration(path, start=1.0).num_frames == 31


def test_pickled_positions_are_not_read(person, save):
    code = np.array([{"a": 1}], dtype=object)
    with pytest.raises(FileFormatError, match="no objects"):
        load_demonstration(save(**complete(person(), positions=code)))


def test_a_million_frames(tmp_path, person):
    """Mapped, so that a part can be taken; refused as a whole."""
    who = person()
    frames = 1_000_000
    path = tmp_path / "long.npy"
    long = np.lib.format.open_memmap(path, "w+", np.float32, (frames, 22, 3))
    long[-who.frames :] = who.pose()[0]
    long.flush()
    with pytest.raises(FileFormatError, match=r"frames: expected at most 100000 .*start and end"):
        load_demonstration(path, fps=30.0)
    part = load_demonstration(path, fps=30.0, start=(frames - who.frames) / 30.0)
    assert part.num_frames == who.frames
    del long
    path.unlink()


@pytest.mark.parametrize("joints", [22, 24, 52])
def test_orders_of_the_smpl_family(person, smpl_parameters, write_body, tmp_path, joints):
    """Told from LAFAN1's 22 and InterMimic's 52 by bones that keep a human length."""
    np.savez(tmp_path / "smpl.npz", **smpl_parameters(person()))
    body = write_body(tmp_path / "body.npz")
    posed = load_demonstration(tmp_path / "smpl.npz", body_model=body)
    np.save(tmp_path / "clip.npy", posed.positions[:, :joints])
    for skeleton in (None, "smpl"):
        demo = load_demonstration(tmp_path / "clip.npy", fps=30.0, skeleton=skeleton)
        np.testing.assert_allclose(demo.keypoints, posed.keypoints, atol=1e-9)
    assert demo.joint_names[:3] == ("Pelvis", "L_Hip", "R_Hip")
