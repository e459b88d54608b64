"""DeepMimic clips of the humanoid (``humanoid3d_*.txt``): joint rotations in JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.arrays import existing, short
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.recording import (
    Recording,
    find_conventions,
    map_joints,
    to_demonstration,
)
from omni_envs.demonstrations.source_options import SourceOptions, kept_fps
from omni_envs.errors import FileFormatError

MAX_BYTES = 64 << 20
"""Largest file: JSON is read whole. 100 000 frames take 70 MB as DeepMimic writes them."""

COLUMNS = 44
_HEIGHT = 1.62  # of the humanoid, m

# Joint, parent, place in the parent's frame (m; x forward, y up, z right), numbers per frame.
_JOINTS = (
    ("root", "", (0.0, 0.0, 0.0), 4),
    ("chest", "root", (0.0, 0.236151, 0.0), 4),
    ("neck", "chest", (0.0, 0.223894, 0.0), 4),
    ("right_hip", "root", (0.0, 0.0, 0.084887), 4),
    ("right_knee", "right_hip", (0.0, -0.421546, 0.0), 1),
    ("right_ankle", "right_knee", (0.0, -0.409870, 0.0), 4),
    ("right_shoulder", "chest", (-0.02405, 0.24350, 0.18311), 4),
    ("right_elbow", "right_shoulder", (0.0, -0.274788, 0.0), 1),
    ("left_hip", "root", (0.0, 0.0, -0.084887), 4),
    ("left_knee", "left_hip", (0.0, -0.421546, 0.0), 1),
    ("left_ankle", "left_knee", (0.0, -0.409870, 0.0), 4),
    ("left_shoulder", "chest", (-0.02405, 0.24350, -0.18311), 4),
    ("left_elbow", "left_shoulder", (0.0, -0.274788, 0.0), 1),
    # Fixed points: the wrist, and the front edge of the sole of the foot's box.
    *((f"{s}_hand", f"{s}_elbow", (0.0, -0.258947, 0.0), 0) for s in ("left", "right")),
    *((f"{s}_toe", f"{s}_ankle", (0.1335, -0.05, 0.0), 0) for s in ("left", "right")),
)
_NAMES = tuple("pelvis" if name == "root" else name for name, _, _, _ in _JOINTS)
_PARENTS = tuple(
    -1 if not parent else [name for name, _, _, _ in _JOINTS].index(parent)
    for _, parent, _, _ in _JOINTS
)


def load_deepmimic(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    terrain_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads a clip of DeepMimic's humanoid at 30 fps.

    A frame is 44 numbers: its duration (s), root position (m, y up), root rotation (wxyz), then the
    rotations of chest, neck, right hip, knee, ankle, shoulder, elbow, and the same on the left;
    knees and elbows are one angle (rad) about z. The humanoid has no toes: the front edge of its
    sole stands for them.

    Args:
        path: JSON file, ``.txt`` or ``.json``.
        options: What the file does not say, or says wrongly.
        terrain_mesh: Mesh of the terrain, z up.

    Raises:
        FileFormatError: The file is missing, no JSON, has no such frames or values that are not
            finite.
    """
    options = SourceOptions() if options is None else options
    path = existing(path, ".txt or .json")
    if path.stat().st_size > MAX_BYTES:
        found = f"{path.stat().st_size >> 20} MiB"
        raise FileFormatError(path, "file", f"at most {MAX_BYTES >> 20} MiB of JSON", found)
    try:
        data = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise FileFormatError(path, "content", "JSON", short(error)) from error
    frames = data.get("Frames") if isinstance(data, dict) else None
    if not isinstance(frames, list) or not frames:
        raise FileFormatError(path, "Frames", "a list of frames", "none")
    try:
        values = np.array(frames, dtype=float)
    except (ValueError, TypeError, OverflowError) as error:
        expected = f"rows of {COLUMNS} numbers"
        raise FileFormatError(path, "Frames", expected, short(error)) from error
    if values.ndim != 2 or values.shape[1] != COLUMNS:
        raise FileFormatError(path, "Frames", f"rows of {COLUMNS} numbers", f"{values.shape}")
    if not np.isfinite(values[:, 0]).all():
        frame = int(np.argmax(~np.isfinite(values[:, 0])))
        found = f"NaN or infinity first in frame {frame}"
        raise FileFormatError(path, "duration of a frame", "finite seconds", found)
    # The last frame's duration is 0 in many clips: it says how long to wait before the loop.
    seconds = float(np.median(values[:, 0]))
    stated = 1.0 / seconds if seconds > 0 else 0.0
    fps = options.frame_rate(path, "duration of a frame", stated)
    rows = options.rows(path, len(values), fps)
    kept = values[rows]
    bad = ~np.isfinite(kept).all(axis=1)
    if bad.any():
        frame = rows.start + rows.step * int(np.argmax(bad))
        found = f"NaN or infinity first in frame {frame}"
        raise FileFormatError(path, "Frames", "finite values", found)
    recording = Recording(path, _NAMES, _pose(path, kept), kept_fps(fps), _PARENTS)
    joints = map_joints(recording, options)
    conventions = find_conventions(recording, joints, options, up="y", unit="m", height=_HEIGHT)
    return to_demonstration(
        recording,
        joints,
        conventions,
        terrain_mesh=terrain_mesh,
        source="DeepMimic",
        licence="MIT; the clips are partly CMU and SFU motion capture",
    )


def _pose(path: Path, values: np.ndarray) -> np.ndarray:
    """(T, J, 3) joints of (T, 44) frames."""
    places: list[np.ndarray] = []
    turns: list[np.ndarray] = []
    column = 4
    for (name, _, offset, numbers), parent in zip(_JOINTS, _PARENTS, strict=True):
        given = values[:, column : column + numbers]
        column += numbers
        if numbers == 4:
            norm = np.linalg.norm(given, axis=1, keepdims=True)
            if (np.abs(norm - 1) > 0.05).any():
                frame = int(np.argmax(np.abs(norm[:, 0] - 1)))
                found = f"length {norm[frame, 0]:.3g} in frame {frame}"
                raise FileFormatError(path, f"rotation of {name}", "unit quaternions wxyz", found)
            turn = given / norm
        else:
            angle = given[:, 0] if numbers else np.zeros(len(values))
            turn = rotations.exp(angle[:, None] * np.array([0.0, 0.0, 1.0]))
        if parent < 0:
            places.append(values[:, 1:4])
            turns.append(turn)
            continue
        bone = np.broadcast_to(np.array(offset), (len(values), 3))
        places.append(places[parent] + rotations.rotate(turns[parent], bone))
        turns.append(rotations.multiply(turns[parent], turn))
    return np.stack(places, axis=1)
