"""Joints of an SMPL body: where they are at rest for a shape, and where a pose takes them.

SMPL (Loper et al. 2015), SMPL-H and SMPL-X share one formula for joints: J = R (v̄ + S β), with the
regressor R, the template v̄ and the shape directions S of the model file, and then forward
kinematics. Skin and pose blend shapes do not move joints, so neither they nor PyTorch are needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations.arrays import read_npz_members
from omni_envs.errors import FileFormatError

_KEYS = ("v_template", "shapedirs", "J_regressor", "kintree_table")
_GENDERS = ("neutral", "female", "male")
_FOLDERS = {
    "smplx": ("smplx/SMPLX_{GENDER}.npz", "SMPLX_{GENDER}.npz"),
    "smplh": ("smplh/{gender}/model.npz", "{gender}/model.npz", "smplh/SMPLH_{GENDER}.npz",
              "SMPLH_{GENDER}.npz"),
    "smpl": ("smpl/SMPL_{GENDER}.npz", "SMPL_{GENDER}.npz"),
}  # fmt: skip
WHERE = (
    "register at smpl-x.is.tue.mpg.de (SMPL-X: SMPLX_NEUTRAL.npz) or mano.is.tue.mpg.de (extended "
    "SMPL-H for AMASS: neutral/model.npz), accept the licence, and give the .npz file or its folder"
)
"""How to get a body model: ours to use, not to ship."""


@dataclass(frozen=True, eq=False)
class BodyModel:
    """What of an SMPL body model the joints need.

    Attributes:
        path: The file.
        template: (V, 3) vertices of the mean shape at rest, m, y up.
        shape_directions: (V, 3, S) displacement per shape parameter, m.
        joint_regressor: (J, V).
        parents: (J,) index of every joint's parent, −1 for the root.
    """

    path: Path
    template: np.ndarray
    shape_directions: np.ndarray
    joint_regressor: np.ndarray
    parents: tuple[int, ...]

    @property
    def num_joints(self) -> int:
        """J: 24 for SMPL, 52 for SMPL-H, 55 for SMPL-X."""
        return len(self.parents)

    def rest(self, betas: np.ndarray) -> tuple[np.ndarray, float]:
        """Joints of a shape at rest.

        Args:
            betas: (B,) shape parameters; B may be less than the model's S.

        Returns:
            (J, 3) joints, m, y up, and the standing height of the body, m.

        Raises:
            FileFormatError: The model has fewer shape directions than there are parameters.
        """
        if len(betas) > self.shape_directions.shape[2]:
            found = f"{self.shape_directions.shape[2]}"
            raise FileFormatError(
                self.path, "shapedirs", f"at least {len(betas)} shape directions", found
            )
        vertices = self.template + self.shape_directions[:, :, : len(betas)] @ betas
        return self.joint_regressor @ vertices, float(np.ptp(vertices[:, 1]))


def pose_joints(
    rest: np.ndarray, parents: Sequence[int], turns: np.ndarray, translation: np.ndarray
) -> np.ndarray:
    """Forward kinematics of a body whose rest pose has no rotations.

    Args:
        rest: (J, 3) joints at rest.
        parents: (J,) parents, before their children; −1 for the root.
        turns: (T, J', 3) rotation vectors of the first J' joints about their parents, rad; the
            others do not turn.
        translation: (T, 3) displacement of the whole body.

    Returns:
        (T, J, 3) joints.
    """
    frames = len(turns)
    places = np.empty((frames, len(rest), 3))
    orientations: list[np.ndarray] = []
    still = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    for joint, parent in enumerate(parents):
        turn = rotations.exp(turns[:, joint]) if joint < turns.shape[1] else still
        if parent < 0:
            places[:, joint] = rest[joint] + translation
            orientations.append(turn)
            continue
        bone = np.broadcast_to(rest[joint] - rest[parent], (frames, 3))
        places[:, joint] = places[:, parent] + rotations.rotate(orientations[parent], bone)
        orientations.append(rotations.multiply(orientations[parent], turn))
    return places


def load_body_model(
    path: str | Path, kind: str | None = None, gender: str | None = None
) -> BodyModel:
    """Loads an SMPL, SMPL-H or SMPL-X model from its ``.npz`` file.

    The models are licensed and come from their makers. ``.pkl`` files are refused: opening one runs
    whatever code is in it.

    Args:
        path: The ``.npz`` file, or a folder with ``smplx/SMPLX_NEUTRAL.npz``,
            ``smplh/neutral/model.npz`` or the like, from which kind and gender choose.
        kind: ``"smpl"``, ``"smplh"`` or ``"smplx"``; needed for a folder.
        gender: ``"neutral"``, ``"female"`` or ``"male"``; neutral where a folder lacks it or None.

    Raises:
        FileFormatError: There is no such model, it is a pickle, or it is damaged.
    """
    path = _find(Path(path), kind, gender)
    if path.suffix.lower() in (".pkl", ".pickle", ".p"):
        expected = "an .npz model (a .pkl can run code when it is opened)"
        raise FileFormatError(path, "body model", expected, f"a pickle; {WHERE}")
    arrays, names = read_npz_members(path, _KEYS)
    missing = [key for key in _KEYS if key not in arrays]
    if missing:
        expected = f"an SMPL model with {', '.join(_KEYS)} as plain arrays"
        found = f"no {', '.join(missing)} among {', '.join(names[:8]) or 'none'}"
        raise FileFormatError(path, "arrays", expected, found)
    template, directions, regressor, tree = (arrays[key] for key in _KEYS)
    vertices = len(template) if template.ndim else 0
    for key, array, fits in (
        ("v_template", template, template.shape == (vertices, 3)),
        ("shapedirs", directions, directions.ndim == 3 and directions.shape[:2] == (vertices, 3)),
        ("J_regressor", regressor, regressor.ndim == 2 and regressor.shape[1] == vertices),
    ):
        if not fits or array.dtype.kind != "f" or not np.isfinite(array).all():
            found = f"{array.dtype} {array.shape}"
            raise FileFormatError(path, key, f"finite numbers for {vertices} vertices", found)
    return BodyModel(
        path,
        template.astype(float),
        directions.astype(float),
        regressor.astype(float),
        _parents(path, tree, len(regressor)),
    )


def _parents(path: Path, tree: np.ndarray, joints: int) -> tuple[int, ...]:
    expected = f"(2, {joints}) integers: parents, before their children"
    if tree.shape != (2, joints) or tree.dtype.kind not in "iu" or joints < 22:
        found = f"{tree.dtype} {tree.shape}"
        raise FileFormatError(path, "kintree_table", expected, found)
    parents = (-1, *(int(parent) for parent in tree[0, 1:]))  # the root's is 2³² − 1
    if any(not 0 <= parent < joint for joint, parent in enumerate(parents) if joint):
        raise FileFormatError(path, "kintree_table", expected, "another order")
    return parents


def _find(path: Path, kind: str | None, gender: str | None) -> Path:
    if path.is_file():
        return path
    if not path.is_dir():
        raise FileFormatError(path, "body model", "an .npz file or a folder", f"nothing; {WHERE}")
    genders = [g for g in (gender, "neutral") if g in _GENDERS]
    kinds = [kind] if kind in _FOLDERS else list(_FOLDERS)
    tried = [
        pattern.format(gender=g, GENDER=g.upper())
        for k in kinds
        for g in dict.fromkeys(genders)
        for pattern in _FOLDERS[str(k)]
    ]
    for name in tried:
        if (path / name).is_file():
            return path / name
    raise FileFormatError(path, "body model", f"{' or '.join(tried)} in it", f"none; {WHERE}")
