"""InterMimic ``.pt`` files: OMOMO clips of people handling objects.

One float tensor (T, 591) at 30 fps, z up, metres. Columns used: 162:318 the 52 joint positions,
318:325 object position and quaternion (xyzw), 331:383 contact flags per joint (1 is contact, −1
unknown), 383:591 joint rotations (xyzw).
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.skeleton import SMPLH
from omni_envs.demonstrations.source_options import MAX_FRAMES, SourceOptions
from omni_envs.errors import FileFormatError, MissingDependencyError
from omni_envs.scenes import Box, Part, Scene, SceneObject, load_convex_parts

FPS = 30.0
COLUMNS = 591
_MAX_BYTES = MAX_FRAMES * COLUMNS * 8

SUBJECT_HEIGHTS = {
    "sub1": 1.6637, "sub2": 1.8438, "sub3": 1.9411, "sub4": 1.7905, "sub5": 1.8171,
    "sub6": 1.7622, "sub7": 1.8078, "sub8": 1.8449, "sub9": 1.7532, "sub10": 1.6510,
    "sub11": 1.7666, "sub12": 1.8030, "sub13": 1.8110, "sub14": 1.8263, "sub15": 1.6846,
    "sub16": 1.7230, "sub17": 1.7366,
}  # fmt: skip
"""Standing height of the OMOMO subjects, m."""

LARGEBOX = Part(
    Box((0.1675, 0.1689, 0.1800)),
    (0.00103, -0.00161, 0.00638),
    (0.97153, -0.07016, -0.04236, 0.22228),
)
"""The OMOMO largebox: the oriented bounding box of its scan.

It is a cardboard box of 0.335 × 0.338 × 0.360 m that lies askew in its own frame: 0.471 × 0.459 ×
0.408 m along the axes.
"""


def load_intermimic(
    path: str | Path,
    options: SourceOptions | None = None,
    *,
    object_mesh: str | Path | None = None,
) -> Demonstration:
    """Loads an InterMimic file.

    Args:
        path: File named ``sub<n>_<object>_<clip>.pt``.
        options: Height (None looks it up by the subject in the file name) and the part to take.
        object_mesh: Mesh of the object. None looks for ``<object>.obj`` beside the file, then for
            an object known by name (``largebox``).

    Raises:
        FileFormatError: The file is missing, damaged, carries pickled code, has another layout or
            values that are not finite, or the object or the height cannot be found.
        MissingDependencyError: PyTorch is not installed.
    """
    options = SourceOptions() if options is None else options
    path = Path(path)
    data = _read(path)
    data = data[options.rows(path, len(data), FPS)]
    height = options.height
    match = re.fullmatch(r"(sub\d+)_(.+?)(?:_\d+)?", path.stem)
    subject, name = match.groups() if match else ("", "")
    if height is None:
        if subject not in SUBJECT_HEIGHTS:
            expected = "sub1_… to sub17_…, whose heights are known, or height="
            raise FileFormatError(path, "subject in the file name", expected, path.stem)
        height = SUBJECT_HEIGHTS[subject]
    if object_mesh is None and name and (beside := path.with_name(f"{name}.obj")).is_file():
        object_mesh = beside
    if object_mesh is not None:
        name, parts = Path(object_mesh).stem, load_convex_parts(object_mesh)
    elif name == "largebox":
        parts = (LARGEBOX,)
    else:
        expected = f"object_mesh=, or a mesh {name or '<object>'}.obj beside the file"
        raise FileFormatError(path, "object", expected, "neither")
    flags = data[:, 331:383] == 1
    hands = {link: SMPLH.contact_joints[link] for link in ("left_hand", "right_hand")}
    return Demonstration(
        name=path.stem,
        fps=FPS,
        joint_names=SMPLH.joint_names,
        positions=data[:, 162:318].reshape(-1, SMPLH.num_joints, 3),
        keypoint_joints=SMPLH.keypoint_joints,
        height=height,
        scene=Scene(object=SceneObject(name, parts)),
        object_poses=data[:, [318, 319, 320, 324, 321, 322, 323]],
        orientations=data[:, 383:591].reshape(-1, SMPLH.num_joints, 4)[..., [3, 0, 1, 2]],
        contacts={
            link: flags[:, [SMPLH.joint_names.index(j) for j in joints]].any(axis=1)
            for link, joints in hands.items()
        },
        contact_joints=SMPLH.contact_joints,
        source="OMOMO, InterMimic layout",
        licence="OMOMO terms: non-commercial research",
    )


def _read(path: Path) -> np.ndarray:
    """Returns the (T, 591) array, checked."""
    try:
        import torch
    except ImportError as error:
        raise MissingDependencyError("torch", "sb3", "Reading .pt files") from error
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing InterMimic .pt file", "nothing")
    expected = f"one tensor of shape (T, {COLUMNS}), T ≥ 1"
    if path.stat().st_size > _MAX_BYTES:  # read whole, unlike arrays that can be mapped
        found = f"{path.stat().st_size >> 20} MiB"
        raise FileFormatError(path, "file", f"at most {_MAX_BYTES >> 20} MiB", found)
    try:
        with warnings.catch_warnings(action="ignore"):  # the error below says it all
            tensor = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises whatever zip, pickle and storage raise
        lines = str(error).strip().splitlines() or [type(error).__name__]
        reason = "pickled code" if "weights_only" in str(error) else lines[0]
        raise FileFormatError(path, "content", expected, f"unreadable data: {reason}") from error
    if not isinstance(tensor, torch.Tensor):
        raise FileFormatError(path, "content", expected, type(tensor).__name__)
    if tensor.ndim != 2 or tensor.shape[1] != COLUMNS or tensor.shape[0] == 0:
        raise FileFormatError(path, "content", expected, f"shape {tuple(tensor.shape)}")
    data = tensor.detach().to(torch.float64).numpy()
    used = {"joint positions": (162, 318), "object pose": (318, 325), "joint rotations": (383, 591)}
    for field, (start, stop) in used.items():
        bad = ~np.isfinite(data[:, start:stop]).all(axis=1)
        if bad.any():
            found = f"NaN or infinity first in frame {int(np.argmax(bad))}"
            raise FileFormatError(path, field, "finite values", found)
    return data
