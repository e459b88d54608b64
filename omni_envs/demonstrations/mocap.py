"""Climbing mocap: ``.npy`` arrays (T, 53, 3) at 120 fps with the terrain beside them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.resampling import FPS, resample_positions
from omni_envs.demonstrations.skeleton import MOCAP
from omni_envs.errors import FileFormatError
from omni_envs.scenes import Part, Scene, Terrain, load_convex_parts

RECORDED_FPS = 120.0
HEIGHT = 1.78
"""Standing height of the recorded person, m."""


def load_mocap(
    path: str | Path, *, terrain_mesh: str | Path | None = None, height: float | None = None
) -> Demonstration:
    """Loads joint positions of a climb or crawl, resampled to 30 fps.

    Args:
        path: ``.npy`` file, (T, 53, 3), 120 fps, z up, m.
        terrain_mesh: Mesh of the terrain at human scale. None takes every ``box_models/*.obj``
            beside the file; without these the ground is flat.
        height: Standing height of the person, m; None is 1.78 m.

    Raises:
        FileFormatError: The file is missing, damaged, carries pickled objects, has another shape or
            values that are not finite, or a terrain mesh cannot be used.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing .npy file", "nothing")
    expected = f"an array (T, {MOCAP.num_joints}, 3), T ≥ 1"
    try:
        positions = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise FileFormatError(path, "content", expected, str(error).splitlines()[0]) from error
    if not isinstance(positions, np.ndarray) or positions.dtype.kind not in "fiu":
        raise FileFormatError(path, "content", expected, f"type {type(positions).__name__}")
    if positions.ndim != 3 or positions.shape[1:] != (MOCAP.num_joints, 3) or not len(positions):
        raise FileFormatError(path, "content", expected, f"shape {positions.shape}")
    bad = ~np.isfinite(positions).all(axis=(1, 2))
    if bad.any():
        found = f"NaN or infinity first in frame {int(np.argmax(bad))}"
        raise FileFormatError(path, "joint positions", "finite values", found)
    beside = sorted(path.parent.glob("box_models/*.obj"))
    meshes: list[str | Path] = [*beside] if terrain_mesh is None else [terrain_mesh]
    parts = tuple(p for mesh in meshes for p in load_convex_parts(mesh) if _stands_out(p))
    return Demonstration(
        name=path.stem,
        fps=FPS,
        joint_names=MOCAP.joint_names,
        positions=resample_positions(positions.astype(float), RECORDED_FPS),
        keypoint_joints=MOCAP.keypoint_joints,
        height=HEIGHT if height is None else height,
        scene=Scene(terrain=Terrain(parts) if parts else None),
        contact_joints=MOCAP.contact_joints,
        source="climbing mocap, holosoma layout",
        licence="see the source of the file",
    )


def _stands_out(part: Part) -> bool:
    """Whether a part rises above the ground; a slab below z = 0 only repeats the ground."""
    return bool(part.mesh().vertices[:, 2].max() > 1e-3)
