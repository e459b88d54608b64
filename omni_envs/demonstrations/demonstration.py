"""Human motion in: the one container that every loader fills."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from omni_envs.errors import InvalidDataError
from omni_envs.robots import CONTACT_LINKS, KEYPOINTS
from omni_envs.scenes import Scene


@dataclass(frozen=True, eq=False)
class Demonstration:
    """A human motion with the scene it happened in, at human scale.

    Attributes:
        name: Name of the clip.
        fps: Frames per second.
        joint_names: J names of the source skeleton.
        positions: (T, J, 3) world joint positions, m, z up.
        keypoint_joints: For every name in ``KEYPOINTS`` the joint that plays it.
        height: Standing height of the human, m.
        scene: Object and terrain at human scale.
        object_poses: (T, 7) object position (m) and quaternion wxyz, or None without object.
        orientations: (T, J, 4) world joint orientations wxyz, if the source has them.
        contacts: Link of ``CONTACT_LINKS`` to (T,) bool: where the source itself flags contact.
            Links without an entry get their contact from distances.
        contact_joints: Link of ``CONTACT_LINKS`` to the joints whose distance decides contact (a
            hand and its fingers, a toe and a heel).
        source: Where the motion comes from.
        licence: Terms of the source.
    """

    name: str
    fps: float
    joint_names: tuple[str, ...]
    positions: np.ndarray
    keypoint_joints: Mapping[str, str]
    height: float
    scene: Scene = field(default_factory=Scene)
    object_poses: np.ndarray | None = None
    orientations: np.ndarray | None = None
    contacts: Mapping[str, np.ndarray] = field(default_factory=dict)
    contact_joints: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    source: str = ""
    licence: str = ""

    def __post_init__(self) -> None:
        def check(ok: bool, name: str, expected: str, found: object) -> None:
            if not ok:
                raise InvalidDataError(f"Demonstration {self.name!r}", name, expected, str(found))

        joints, shape = len(self.joint_names), np.shape(self.positions)
        check(len(set(self.joint_names)) == joints, "joint_names", "unique", "duplicates")
        check(len(shape) == 3 and shape[1:] == (joints, 3), "positions", f"(T, {joints}, 3)", shape)
        frames = shape[0]
        check(frames >= 1, "positions", "at least 1 frame", "0 frames")
        check(np.isfinite(self.fps) and self.fps > 0, "fps", "positive", self.fps)
        check(np.isfinite(self.height) and self.height > 0, "height", "positive (m)", self.height)
        for name in KEYPOINTS:
            joint = self.keypoint_joints.get(name)
            check(joint is not None, "keypoint_joints", f"a table with {name!r}", "no such entry")
            check(
                joint in self.joint_names,
                f"keypoint_joints[{name!r}]",
                f"one of {', '.join(self.joint_names)}",
                repr(joint),
            )
        arrays = {
            "positions": (self.positions, shape),
            "orientations": (self.orientations, (frames, joints, 4)),
            "object_poses": (self.object_poses, (frames, 7)),
        }
        for name, (array, expected) in arrays.items():
            if array is None:
                continue
            check(np.shape(array) == expected, name, str(expected), np.shape(array))
            bad = ~np.isfinite(array)
            check(not bad.any(), name, "finite", f"NaN or infinity first at {_first(bad)}")
        if self.object_poses is not None:
            norm = np.linalg.norm(self.object_poses[:, 3:], axis=1)
            bad = np.abs(norm - 1) > 1e-3
            check(not bad.any(), "object_poses", "unit quaternions wxyz", f"frame {_first(bad)}")
        check(
            (self.object_poses is None) == (self.scene.object is None),
            "object_poses",
            "given exactly when the scene has an object",
            f"object {'absent' if self.scene.object is None else 'present'}",
        )
        for link, flags in self.contacts.items():
            check(link in CONTACT_LINKS, "contacts", f"keys among {CONTACT_LINKS}", link)
            check(
                np.shape(flags) == (frames,), f"contacts[{link!r}]", f"({frames},)", np.shape(flags)
            )
        for link, names in self.contact_joints.items():
            check(link in CONTACT_LINKS, "contact_joints", f"keys among {CONTACT_LINKS}", link)
            missing = [n for n in names if n not in self.joint_names]
            check(not missing, f"contact_joints[{link!r}]", "joints of the skeleton", missing)

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.positions)

    @property
    def keypoints(self) -> np.ndarray:
        """(T, 15, 3) keypoint positions in the order of ``KEYPOINTS``."""
        index = [self.joint_names.index(self.keypoint_joints[k]) for k in KEYPOINTS]
        return self.positions[:, index]


def _first(mask: np.ndarray) -> tuple[int, ...]:
    return tuple(int(i) for i in np.argwhere(mask)[0]) if mask.any() else ()
