"""Climbing mocap: ``.npy`` arrays (T, 53, 3) at 120 fps with the terrain beside them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from omni_envs.demonstrations.arrays import map_npy
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.resampling import FPS, resample_positions
from omni_envs.demonstrations.skeleton import MOCAP
from omni_envs.demonstrations.source_options import SourceOptions, kept_fps
from omni_envs.errors import FileFormatError
from omni_envs.scenes import Part, Scene, Terrain, load_convex_parts

RECORDED_FPS = 120.0
HEIGHT = 1.78
"""Standing height of the recorded person, m."""


def load_mocap(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    terrain_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads joint positions of a climb or crawl, resampled to 30 fps.

    Args:
        path: ``.npy`` file, (T, 53, 3), 120 fps, z up, m.
        options: Height (None is 1.78 m), frame rate (None is 120 fps), and the part to take.
        terrain_mesh: Mesh of the terrain at human scale. None takes every ``box_models/*.obj``
            beside the file; without these the ground is flat.

    Raises:
        FileFormatError: The file is missing, damaged, carries pickled objects, has another shape or
            values that are not finite, or a terrain mesh cannot be used.
    """
    options = SourceOptions() if options is None else options
    path = Path(path)
    expected = f"an array (T, {MOCAP.num_joints}, 3), T ≥ 1"
    recorded = map_npy(path, expected)
    if recorded.ndim != 3 or recorded.shape[1:] != (MOCAP.num_joints, 3) or not len(recorded):
        raise FileFormatError(path, "content", expected, f"shape {recorded.shape}")
    fps = options.frame_rate(path, "fps", RECORDED_FPS)
    rows = options.rows(path, len(recorded), fps)
    bad = ~np.isfinite(recorded[rows.start : rows.stop]).all(axis=(1, 2))
    if bad.any():
        found = f"NaN or infinity first in frame {rows.start + int(np.argmax(bad))}"
        raise FileFormatError(path, "joint positions", "finite values", found)
    positions = np.array(recorded[rows], float)
    beside = sorted(path.parent.glob("box_models/*.obj"))
    meshes: list[str | Path] = [*beside] if terrain_mesh is None else [terrain_mesh]
    parts = tuple(p for mesh in meshes for p in load_convex_parts(mesh) if _stands_out(p))
    return Demonstration(
        name=path.stem,
        fps=FPS,
        joint_names=MOCAP.joint_names,
        positions=resample_positions(positions, kept_fps(fps)),
        keypoint_joints=MOCAP.keypoint_joints,
        height=options.height or HEIGHT,
        scene=Scene(terrain=Terrain(parts) if parts else None),
        contact_joints=MOCAP.contact_joints,
        source="climbing mocap, holosoma layout",
        licence="see the source of the file",
    )


def _stands_out(part: Part) -> bool:
    """Whether a part rises above the ground; a slab below z = 0 only repeats the ground."""
    return bool(part.mesh().vertices[:, 2].max() > 1e-3)
