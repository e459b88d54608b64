"""References as one table of frames, from which N simulations read a frame each in one gather."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omni_envs.errors import InvalidDataError, InvalidOptionError
from omni_envs.references import Reference
from omni_envs.robots import Robot
from omni_envs.tracking.alignment import Bodies

MIN_FRAMES = 3
"""A motion needs a start, a step and an end."""


class Frames(NamedTuple):
    """One reference frame for each of N simulations.

    Attributes:
        qpos: (N, 7 + n).
        qvel: (N, 6 + n), root angular velocity in the body frame.
        bodies: The tracked bodies.
        object_pose: (N, 7), or None.
        object_velocity: (N, 6) world linear, world angular, or None.
        target: (N, n) joint positions that residual actions count from, rad, or None.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    bodies: Bodies
    object_pose: np.ndarray | None
    object_velocity: np.ndarray | None
    target: np.ndarray | None = None


class Columns(NamedTuple):
    """First column of every part of the table's rows; see ``Frames`` for the parts.

    Attributes:
        qpos: 7 + n columns.
        qvel: 6 + n columns.
        position: 3 columns per tracked body.
        quaternion: 4 columns per tracked body.
        linear: 3 columns per tracked body.
        angular: 3 columns per tracked body.
        object_pose: 7 columns; the end of the row without an object, as the next.
        object_velocity: 6 columns.
    """

    qpos: int
    qvel: int
    position: int
    quaternion: int
    linear: int
    angular: int
    object_pose: int
    object_velocity: int


class MotionLibrary:
    """The frames of one or more references of one robot, one after the other.

    Attributes:
        starts: (M,) first frame of every motion in the table.
        lengths: (M,) frames of every motion.
        has_object: Whether the motions carry an object.
        table: (rows, columns) all frames.
        at: Where the parts of a frame are in its row.
        targets: (rows, n) what residual actions count from, or None.

    Args:
        robot: The robot.
        references: Its references, all with an object or all without.
        fps: Frame rate that they must have: the control rate.
        targets: (T, n) per reference, what residual actions count from, or None.

    Raises:
        InvalidDataError: A reference is of another robot, too short, at another rate, or without
            the object that the others have.
    """

    def __init__(
        self,
        robot: Robot,
        references: Sequence[Reference],
        fps: float,
        targets: Sequence[np.ndarray] | None = None,
    ) -> None:
        if not references:
            raise InvalidDataError("Environment", "reference", "at least one reference", "none")
        self.has_object = references[0].object_poses is not None
        for r in references:
            owner = f"Reference of {r.robot!r}"
            if r.robot != robot.name:
                raise InvalidDataError(owner, "robot", repr(robot.name), repr(r.robot))
            if r.num_frames < MIN_FRAMES:
                found = f"{r.num_frames}"
                raise InvalidDataError(owner, "qpos", f"{MIN_FRAMES} frames at least", found)
            if not np.isclose(r.fps, fps):
                raise InvalidDataError(owner, "fps", f"{fps:g}, the control rate", f"{r.fps:g}")
            if (r.object_poses is not None) != self.has_object:
                expected = "given in all references or in none"
                raise InvalidDataError(owner, "object_poses", expected, "a mixture")
        self._bodies, self._nq, self._nv = len(robot.tracked_bodies), robot.nq, robot.nv
        self.lengths = np.array([r.num_frames for r in references])
        self.starts = np.concatenate([[0], np.cumsum(self.lengths)[:-1]])
        self.table = np.concatenate([self._rows(robot, r) for r in references])
        self.targets = None if targets is None else np.concatenate(targets)
        b = self._bodies
        sizes = [self._nq, self._nv, 3 * b, 4 * b, 3 * b, 3 * b, 7 if self.has_object else 0]
        self.at = Columns(*(int(c) for c in np.cumsum([0, *sizes])))

    @property
    def num_motions(self) -> int:
        """M."""
        return len(self.lengths)

    @property
    def num_frames(self) -> int:
        """Frames of all motions together."""
        return len(self.table)

    def frames(self, index: np.ndarray) -> Frames:
        """Returns the table's frames at (N,) indices, as fresh arrays."""
        frames = self._split(np.take(self.table, index, axis=0))
        if self.targets is None:
            return frames
        return frames._replace(target=np.take(self.targets, index, axis=0))

    def places(
        self, motion: int | np.ndarray | None, frame: int | np.ndarray | None, count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns (count,) motions and start frames within them, as asked for.

        Args:
            motion: One for all or (count,); the first by default.
            frame: One for all or (count,); the first by default.
            count: How many.

        Raises:
            InvalidOptionError: There is no such motion, or no frame left to track after the start.
        """
        motions, places = (np.asarray(0 if p is None else p) for p in (motion, frame))
        for name, given in (("motion", motions), ("frame", places)):
            if given.shape not in ((), (count,)):
                raise InvalidOptionError(
                    f"reset: {name} must be one for all, or one for each of the {count} "
                    f"simulations that start; got shape {given.shape}."
                )
        # Arrays of their own: loops are compiled anew for others.
        motions, places = (np.full(count, given) for given in (motions, places))
        whole = all(np.issubdtype(a.dtype, np.integer) for a in (motions, places))
        inside = whole and np.isin(motions, np.arange(self.num_motions)).all()
        if not inside or not ((places >= 0) & (places <= self.lengths[motions] - 2)).all():
            raise InvalidOptionError(
                f"reset: motion must be below {self.num_motions} and frame from 0 to the last but "
                "one of the motion, whole numbers; the motions have "
                f"{self.lengths.tolist()} frames."
            )
        return motions, places

    def _rows(self, robot: Robot, r: Reference) -> np.ndarray:
        tracked = r.body_indices(robot.tracked_bodies)
        parts = [
            r.qpos,
            r.qvel,
            r.body_positions[:, tracked],
            r.body_quaternions[:, tracked],
            r.body_linear_velocities[:, tracked],
            r.body_angular_velocities[:, tracked],
        ]
        if r.object_poses is not None and r.object_velocities is not None:
            parts += [r.object_poses, r.object_velocities]
        return np.concatenate([np.reshape(p, (r.num_frames, -1)) for p in parts], axis=1)

    def _split(self, rows: np.ndarray) -> Frames:
        n, b, start = len(rows), self._bodies, 0

        def take(size: int) -> np.ndarray:
            nonlocal start
            start += size
            return rows[:, start - size : start]

        qpos, qvel = take(self._nq), take(self._nv)
        position, q = take(3 * b).reshape(n, b, 3), take(4 * b).reshape(n, b, 4)
        linear, angular = take(3 * b).reshape(n, b, 3), take(3 * b).reshape(n, b, 3)
        objects = (take(7), take(6)) if self.has_object else (None, None)
        return Frames(qpos, qvel, Bodies(position, q, linear, angular), *objects)
