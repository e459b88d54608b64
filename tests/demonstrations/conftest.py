import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omni_envs.demonstrations import SMPLH, Demonstration
from omni_envs.demonstrations.namings import SMPL_BODY
from omni_envs.scenes import Box, Part, Scene, SceneObject


def shared_folder() -> Path:
    default = Path(__file__).resolve().parents[2].parent / "shared"
    return Path(os.environ.get("OMNI_ENVS_SHARED", default))


@pytest.fixture(scope="session")
def shared():
    """Recorded data and peers' outputs, which are not part of the repository."""
    folder = shared_folder()
    if not (folder / "data").is_dir():
        pytest.skip(f"no recorded data: {folder}/data (set OMNI_ENVS_SHARED)")
    return folder


@pytest.fixture
def intermimic_array():
    """A plausible (T, 591) InterMimic array: a standing person and a box that starts to move."""
    rng = np.random.default_rng(0)
    frames = 6
    data = np.zeros((frames, 591), np.float32)
    data[:, 162:318] = rng.uniform(0.2, 1.6, (1, 156))
    data[:, 318:321] = [1.0, 0.5, 0.2]
    data[3:, 320] += 0.1 * np.arange(3)
    data[:, 321:325] = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # xyzw: 90° about z
    data[:, 383:591] = np.tile([0.0, 0.0, 0.0, 1.0], 52)
    data[:, 331:383] = -1
    data[4, 331 + 20] = 1  # a finger of the left hand
    return data


@pytest.fixture
def pushed_box():
    """A person at (0, 0) with a palm that touches a unit-free box of 0.4 m from frame 2 on."""
    frames = 4
    positions = np.zeros((frames, SMPLH.num_joints, 3))
    index = SMPLH.joint_names.index
    positions[..., 2] = 1.0
    positions[:, [index("L_Toe"), index("R_Toe")], 2] = 0.03
    poses = np.tile([1.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0], (frames, 1))
    positions[2:, index("L_Wrist")] = [0.79, 0.0, 0.2]
    return Demonstration(
        name="push",
        fps=30.0,
        joint_names=SMPLH.joint_names,
        positions=positions,
        keypoint_joints=SMPLH.keypoint_joints,
        height=1.65,
        scene=Scene(object=SceneObject("box", (Part(Box((0.2, 0.2, 0.2))),))),
        object_poses=poses,
        contact_joints=SMPLH.contact_joints,
    )


# A person in the tree of LAFAN1: joint, parent, offset in the T-pose (m; x left, y up, z forward).
_TREE = [("Hips", "", (0.0, 0.0, 0.0))]
for _side, _s in (("Left", 1.0), ("Right", -1.0)):
    _TREE += [
        (f"{_side}UpLeg", "Hips", (0.1 * _s, -0.02, 0.0)),
        (f"{_side}Leg", f"{_side}UpLeg", (0.0, -0.43, 0.0)),
        (f"{_side}Foot", f"{_side}Leg", (0.0, -0.42, 0.0)),
        (f"{_side}Toe", f"{_side}Foot", (0.0, -0.06, 0.14)),
    ]
_TREE += [
    ("Spine", "Hips", (0.0, 0.1, 0.0)),
    ("Spine1", "Spine", (0.0, 0.12, 0.0)),
    ("Spine2", "Spine1", (0.0, 0.12, 0.0)),
    ("Neck", "Spine2", (0.0, 0.2, 0.0)),
    ("Head", "Neck", (0.0, 0.1, 0.0)),
]
for _side, _s in (("Left", 1.0), ("Right", -1.0)):
    _TREE += [
        (f"{_side}Shoulder", "Spine2", (0.05 * _s, 0.15, 0.0)),
        (f"{_side}Arm", f"{_side}Shoulder", (0.12 * _s, 0.0, 0.0)),
        (f"{_side}ForeArm", f"{_side}Arm", (0.29 * _s, 0.0, 0.0)),
        (f"{_side}Hand", f"{_side}ForeArm", (0.25 * _s, 0.0, 0.0)),
    ]
_ENDS = {"Head": (0.0, 0.2, 0.0)}
for _side, _s in (("Left", 1.0), ("Right", -1.0)):
    _ENDS |= {f"{_side}Hand": (0.1 * _s, 0.0, 0.0), f"{_side}Toe": (0.0, 0.0, 0.06)}
HIPS = 0.02 + 0.43 + 0.42 + 0.06  # height of the hips over the toes


class Person:
    """Stands for a second, lifts the left leg forward and puts it down, for another second.

    Faces +z with y up, left is +x; the arms hang.
    """

    names = tuple(name for name, _, _ in _TREE)
    parents = tuple(([n for n, _, _ in _TREE].index(p) if p else -1) for _, p, _ in _TREE)
    offsets = np.array([offset for _, _, offset in _TREE])
    ends = _ENDS

    def __init__(self, fps=30.0, seconds=2.0, place=(0.3, 0.0, -0.2)):
        self.fps, self.frames = fps, round(fps * seconds) + 1
        t = np.arange(self.frames) / fps
        lift = np.clip(np.sin(np.pi * (t - 1.0)), 0.0, None)
        self.local = {name: Rotation.identity(self.frames) for name in self.names}

        def turn(name, axis, angle):
            vector = np.zeros((self.frames, 3))
            vector[:, "xyz".index(axis)] = angle
            self.local[name] = Rotation.from_rotvec(vector)

        turn("LeftUpLeg", "x", -0.8 * lift)
        turn("LeftLeg", "x", 0.6 * lift)
        turn("LeftArm", "z", -1.4 + 0 * t)
        turn("RightArm", "z", 1.4 + 0 * t)
        self.root = np.tile(np.add(place, [0.0, HIPS, 0.0]), (self.frames, 1))

    def pose(self):
        """(T, J, 3) joints, y up, m, and the rotation of every joint in the world."""
        places, turns = [], []
        for name, parent, offset in zip(self.names, self.parents, self.offsets, strict=True):
            local = self.local[name]
            if parent < 0:
                places.append(self.root)
                turns.append(local)
                continue
            places.append(places[parent] + turns[parent].apply(offset))
            turns.append(turns[parent] * local)
        return np.stack(places, axis=1), turns


def _along_x(offset):
    """A frame whose x axis points along an offset."""
    x = np.array(offset) / np.linalg.norm(offset)
    z = np.cross(x, [0.31, 0.42, 0.85])
    z /= np.linalg.norm(z)
    return Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=1))


def bvh_text(
    person,
    rename=lambda name: name,
    unit=0.01,
    order="ZYX",
    bones_along_x=False,
    z_up=False,
    rest_y_up=False,
    root_unit=None,
    skip=(),
):
    """The person as a BVH file.

    Args:
        person: Who.
        rename: From our joint names to those of the file.
        unit: Metres per unit of the file.
        order: Rotation channels.
        bones_along_x: Local frames as LAFAN1 has them, with zero rotations no person at all.
        z_up: Axes of the file.
        rest_y_up: The rest skeleton stays y up in a file that is z up.
        root_unit: Unit of the root's position, where it is another.
        skip: Joints to leave out; their end sites stay with the parent.
    """
    turned = Rotation.from_euler("x", 90 if z_up else 0, degrees=True)  # (x, y, z) → (x, −z, y)
    upright = Rotation.identity() if rest_y_up else turned.inv()
    frames = dict.fromkeys(person.names, upright)
    if bones_along_x:
        for name in person.names:
            child = next((i for i, p in enumerate(person.parents) if p >= 0 and
                          person.names[p] == name and any(person.offsets[i])), None)  # fmt: skip
            offset = person.offsets[child] if child is not None else person.ends[name]
            frames[name] = _along_x(offset)
    columns, lines = [], ["HIERARCHY"]
    rotations = " ".join(f"{axis}rotation" for axis in order)

    def vector(v):
        return " ".join(f"{c / unit:.6f}" for c in v)

    def end_site(pad, offset):
        lines.append(f"{pad}\tEnd Site\n{pad}\t{{\n{pad}\t\tOFFSET {vector(offset)}\n{pad}\t}}")

    def write(index, depth):
        name, pad = person.names[index], "\t" * depth
        parent = person.parents[index]
        above = frames[person.names[parent]] if parent >= 0 else turned.inv()
        lines.append(f"{pad}{'JOINT' if parent >= 0 else 'ROOT'} {rename(name)}")
        lines.append(pad + "{")
        place = above.inv().apply(person.offsets[index]) if parent >= 0 else (0, 0, 0)
        lines.append(f"{pad}\tOFFSET {vector(place)}")
        local = above.inv() * person.local[name] * frames[name]
        if parent < 0:
            lines.append(f"{pad}\tCHANNELS 6 Xposition Yposition Zposition {rotations}")
            columns.append(turned.apply(person.root) / (root_unit or unit))
        else:
            lines.append(f"{pad}\tCHANNELS 3 {rotations}")
        columns.append(local.as_euler(order, degrees=True))
        children = [i for i, p in enumerate(person.parents) if p == index]
        for child in children:
            if person.names[child] in skip:
                end_site(pad, frames[name].inv().apply(person.offsets[child]))
            else:
                write(child, depth + 1)
        if not children:
            end_site(pad, frames[name].inv().apply(person.ends[name]))
        lines.append(pad + "}")

    write(0, 0)
    rows = np.concatenate(columns, axis=1)
    lines += ["MOTION", f"Frames: {person.frames}", f"Frame Time: {1 / person.fps:.6f}"]
    lines += [" ".join(f"{v:.6f}" for v in row) for row in rows]
    return "\n".join(lines) + "\n"


@pytest.fixture
def person():
    """Class of the person that small files are made of."""
    return Person


@pytest.fixture
def write_bvh(tmp_path):
    """Writes a person as a BVH file: ``write_bvh(person, name="clip.bvh", **how)``."""

    def write(person, name="clip.bvh", **how):
        path = tmp_path / name
        path.write_text(bvh_text(person, **how))
        return path

    return write


def _smpl_body():
    """Rest joints (52, 3), y up, and parents of a synthetic SMPL-H body like ``Person``."""
    place = {}
    for name, parent, offset in _TREE:
        place[name] = np.add(place[parent] if parent else np.zeros(3), offset)
    ours = {
        "Pelvis": "Hips", "Spine1": "Spine", "Spine2": "Spine1", "Spine3": "Spine2",
        "Neck": "Neck", "Head": "Head",
    }  # fmt: skip
    for side, s in (("Left", "L"), ("Right", "R")):
        for smpl, name in (
            ("Hip", "UpLeg"), ("Knee", "Leg"), ("Ankle", "Foot"), ("Foot", "Toe"),
            ("Collar", "Shoulder"), ("Shoulder", "Arm"), ("Elbow", "ForeArm"), ("Wrist", "Hand"),
        ):  # fmt: skip
            ours[f"{s}_{smpl}"] = side + name
    parents = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
    rest = [place[ours[name]] for name in SMPL_BODY]
    for wrist, sign in ((20, 1.0), (21, -1.0)):
        for finger in range(5):
            for bone in range(3):
                parents.append(wrist if bone == 0 else len(rest) - 1)
                rest.append(rest[wrist] + [sign * (0.08 + 0.02 * bone), 0.0, 0.01 * finger])
    return np.array(rest), parents


@pytest.fixture
def write_body():
    """Writes a synthetic body model: ``write_body(path, **changed_arrays)``.

    Two vertices per joint, whose middle is the joint; the first shape parameter makes everything
    10 % larger per unit.
    """
    rest, parents = _smpl_body()

    def write(path, **changed):
        away = np.array([[0.0, 0.03, 0.0]])
        template = np.concatenate([rest + away, rest - away])
        directions = np.zeros((*template.shape, 16))
        directions[..., 0] = 0.1 * template
        regressor = np.hstack([0.5 * np.eye(len(rest))] * 2)
        root = np.uint32(2**32 - 1)
        table = np.array([[root, *parents[1:]], range(len(rest))], dtype=np.uint32)
        arrays = {
            "v_template": template,
            "shapedirs": directions,
            "J_regressor": regressor,
            "kintree_table": table,
            "f": np.zeros((4, 3), np.uint32),
            **changed,
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, **{name: a for name, a in arrays.items() if a is not None})
        return path

    return write


@pytest.fixture
def smpl_parameters():
    """Arrays of an AMASS file in which ``Person`` moves: z up, 52 joints."""

    def make(person):
        rest, _ = _smpl_body()
        turned = Rotation.from_euler("x", 90, degrees=True)
        poses = np.zeros((person.frames, 52, 3))
        poses[:, 0] = turned.as_rotvec()
        for joint, name in ((1, "LeftUpLeg"), (4, "LeftLeg"), (16, "LeftArm"), (17, "RightArm")):
            poses[:, joint] = person.local[name].as_rotvec()
        return {
            "trans": turned.apply(person.root) - rest[0],
            "poses": poses.reshape(person.frames, -1),
            "betas": np.zeros(16),
            "gender": np.array("neutral"),
            "mocap_framerate": np.array(person.fps),
            "dmpls": np.zeros((person.frames, 8)),
        }

    return make
