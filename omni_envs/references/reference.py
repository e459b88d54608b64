"""Robot motion out: the one container that environments, exporters and viewers read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.errors import InvalidDataError
from omni_envs.metrics.report import ReferenceReport
from omni_envs.robots import CONTACT_LINKS, get_robot, robot_names
from omni_envs.scenes import Scene


@dataclass(frozen=True, eq=False)
class Reference:
    """A robot motion with its velocities, scene, schedules, proof and origin.

    Velocities are those that the simulator reports when it is put at (qpos, qvel).

    Attributes:
        robot: Name of the robot.
        fps: Frames per second.
        qpos: (T, 7 + n) root position (m), root quaternion wxyz, hinges (rad) in model order.
        qvel: (T, 6 + n) root velocity in the world (m/s), root angular velocity in the **body**
            frame (rad/s), hinges (rad/s).
        body_names: B names of the robot's bodies in model order, the world left out.
        body_positions: (T, B, 3) origins of the bodies in the world, m.
        body_quaternions: (T, B, 4) wxyz.
        body_linear_velocities: (T, B, 3) of the body **origins** in the world, m/s.
        body_angular_velocities: (T, B, 3) in the world, rad/s.
        stance: (T, 2) bool, left and right foot planted.
        scene: Ground, object, terrain.
        object_poses: (T, 7) position and quaternion wxyz, or None without object.
        object_velocities: (T, 6) linear and angular velocity in the world, or None without object.
        contacts: Link of ``CONTACT_LINKS`` to (T,) bool: touches object or terrain.
        report: Metrics of every frame, or None where not evaluated.
        source: The demonstration at robot scale and at the same frames, or None for foreign
            motions.
        provenance: JSON-compatible facts about the origin.
    """

    robot: str
    fps: float
    qpos: np.ndarray
    qvel: np.ndarray
    body_names: tuple[str, ...]
    body_positions: np.ndarray
    body_quaternions: np.ndarray
    body_linear_velocities: np.ndarray
    body_angular_velocities: np.ndarray
    stance: np.ndarray
    scene: Scene = field(default_factory=Scene)
    object_poses: np.ndarray | None = None
    object_velocities: np.ndarray | None = None
    contacts: Mapping[str, np.ndarray] = field(default_factory=dict)
    report: ReferenceReport | None = None
    source: SourceMotion | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "body_names", tuple(self.body_names))
        _validate(self)

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.qpos)

    @property
    def duration(self) -> float:
        """Time from the first to the last frame, s."""
        return (self.num_frames - 1) / self.fps

    @property
    def joint_positions(self) -> np.ndarray:
        """(T, n) hinges, rad."""
        return self.qpos[:, 7:]

    @property
    def joint_velocities(self) -> np.ndarray:
        """(T, n) hinges, rad/s."""
        return self.qvel[:, 6:]

    def body_indices(self, names: Sequence[str]) -> np.ndarray:
        """Returns the (K,) places of bodies in the body arrays.

        Raises:
            InvalidDataError: The robot has no such body.
        """
        missing = [name for name in names if name not in self.body_names]
        if missing:
            raise InvalidDataError(
                f"Reference of {self.robot!r}", "body", f"one of {self.body_names}", repr(missing)
            )
        return np.array([self.body_names.index(name) for name in names])

    def save(self, path: str | Path) -> Path:
        """Writes one ``.npz`` without pickles, atomically.

        Returns:
            The path.
        """
        from omni_envs.references.archive import reference_to_arrays
        from omni_envs.references.npz import write_npz

        return write_npz(path, reference_to_arrays(self))

    @classmethod
    def load(cls, path: str | Path) -> Reference:
        """Reads what ``save`` wrote.

        Raises:
            FileFormatError: The file is missing, damaged, foreign or does not fit its robot.
        """
        from omni_envs.references.archive import reference_from_arrays
        from omni_envs.references.npz import read_npz

        return reference_from_arrays(path, read_npz(path))


def _validate(r: Reference) -> None:
    def check(ok: object, name: str, expected: str, found: object) -> None:
        if not ok:
            raise InvalidDataError(f"Reference of {r.robot!r}", name, expected, str(found))

    check(isinstance(r.robot, str) and r.robot, "robot", "a name", repr(r.robot))
    check(np.isfinite(r.fps) and r.fps > 0, "fps", "positive", r.fps)
    shape = np.shape(r.qpos)
    check(len(shape) == 2 and shape[1] >= 7, "qpos", "(T, 7 + hinges)", shape)
    check(shape[0] >= 1, "qpos", "at least 1 frame", "0 frames")
    if r.robot in robot_names():
        robot = get_robot(r.robot)
        check(shape[1] == robot.nq, "qpos", f"(T, {robot.nq}) for {robot.title}", shape)
        check(r.body_names == robot.body_names, "body_names", "those of the robot", r.body_names)
    frames, bodies = shape[0], len(r.body_names)
    check(
        (r.object_poses is None) == (r.scene.object is None),
        "object_poses",
        "given exactly when the scene has an object",
        f"object {'absent' if r.scene.object is None else 'present'}",
    )
    check(
        (r.object_velocities is None) == (r.object_poses is None),
        "object_velocities",
        "given exactly when object_poses are",
        "only one of the two",
    )
    expected: dict[str, tuple[int, ...]] = {
        "qpos": shape,
        "qvel": (frames, shape[1] - 1),
        "body_positions": (frames, bodies, 3),
        "body_quaternions": (frames, bodies, 4),
        "body_linear_velocities": (frames, bodies, 3),
        "body_angular_velocities": (frames, bodies, 3),
        "object_poses": (frames, 7),
        "object_velocities": (frames, 6),
    }
    for name, size in expected.items():
        array = getattr(r, name)
        if array is None:
            continue
        check(np.shape(array) == size, name, str(size), np.shape(array))
        check(np.issubdtype(np.asarray(array).dtype, np.floating), name, "floats", array.dtype)
        bad = ~np.isfinite(array)
        check(not bad.any(), name, "finite", f"NaN or infinity first at {_first(bad)}")
    for name, quaternions in (
        ("qpos", r.qpos[:, 3:7]),
        ("body_quaternions", r.body_quaternions),
        ("object_poses", None if r.object_poses is None else r.object_poses[:, 3:]),
    ):
        if quaternions is not None:
            bad = np.abs(np.linalg.norm(quaternions, axis=-1) - 1) > 1e-3
            check(not bad.any(), name, "unit quaternions wxyz", f"another norm at {_first(bad)}")
    flags = {f"contacts[{link!r}]": f for link, f in r.contacts.items()}
    check(
        set(r.contacts) <= set(CONTACT_LINKS),
        "contacts",
        f"keys among {CONTACT_LINKS}",
        flags.keys(),
    )
    for name, array, size in [
        *((name, f, (frames,)) for name, f in flags.items()),
        ("stance", r.stance, (frames, 2)),
    ]:
        check(np.shape(array) == size, name, str(size), np.shape(array))
        check(np.asarray(array).dtype == bool, name, "bool", np.asarray(array).dtype)
    for name, part in (("report", r.report), ("source", r.source)):
        if part is not None:
            check(part.num_frames == frames, name, f"of {frames} frames", part.num_frames)
            check(np.isclose(part.fps, r.fps), name, f"at {r.fps} fps", part.fps)


def _first(mask: np.ndarray) -> tuple[int, ...]:
    return tuple(int(i) for i in np.argwhere(mask)[0]) if mask.any() else ()
