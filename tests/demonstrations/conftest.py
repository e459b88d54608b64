import os
from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import SMPLH, Demonstration
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
