import os
from pathlib import Path

import mujoco
import numpy as np
import pytest

from omni_envs.demonstrations import SourceMotion
from omni_envs.robots import G1
from omni_envs.scenes import Scene

_SHARED = Path(os.environ.get("OMNI_ENVS_SHARED", Path(__file__).parents[3] / "shared"))


@pytest.fixture(scope="session")
def shared():
    """The folder of measured anchors and clips, which is not part of the repository."""
    if not (_SHARED / "anchors").is_dir():
        pytest.skip(f"no anchors in {_SHARED} (set OMNI_ENVS_SHARED)")
    return _SHARED


def _standing(frames: int = 1, lift: float = 0.0) -> np.ndarray:
    """(T, nq) the default pose, the lowest point of the flat soles at z = ``lift``."""
    qpos = np.tile(G1.default_qpos, (frames, 1))
    qpos[:, 2] += lift - _lowest(qpos[0])
    return qpos


def _lowest(q: np.ndarray) -> float:
    data = mujoco.MjData(G1.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(G1.model, data)
    low = []
    for g in range(G1.model.ngeom):
        if int(G1.model.geom_group[g]) not in (3, 4):
            continue
        size, down = G1.model.geom_size[g], data.geom_xmat[g].reshape(3, 3)[2]
        reach = {
            mujoco.mjtGeom.mjGEOM_SPHERE: lambda s, d: s[0],
            mujoco.mjtGeom.mjGEOM_CAPSULE: lambda s, d: s[0] + abs(d[2]) * s[1],
            mujoco.mjtGeom.mjGEOM_CYLINDER: lambda s, d: (
                s[0] * np.hypot(d[0], d[1]) + abs(d[2]) * s[1]
            ),
            mujoco.mjtGeom.mjGEOM_ELLIPSOID: lambda s, d: np.linalg.norm(s * d),
            mujoco.mjtGeom.mjGEOM_BOX: lambda s, d: np.abs(s * d).sum(),
        }[mujoco.mjtGeom(int(G1.model.geom_type[g]))]
        low.append(data.geom_xpos[g, 2] - reach(size, down))
    return min(low)


@pytest.fixture
def standing():
    return _standing


def _source(keypoints: np.ndarray, fps: float = 50.0, scene: Scene | None = None, **fields):
    frames = len(keypoints)
    stance = np.ones((frames, 2), bool)
    values = {
        "name": "test",
        "fps": fps,
        "scale": 1.0,
        "keypoints": keypoints,
        "scene": scene or Scene(),
        "object_poses": None,
        "source_object_poses": None,
        "stance": {"text": stance, "default": stance, "code": stance},
    }
    return SourceMotion(**{**values, **fields})


@pytest.fixture
def make_source():
    return _source
