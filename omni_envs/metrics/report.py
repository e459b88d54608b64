"""The proof of a reference: every constraint and every objective on every frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from omni_envs.errors import InvalidDataError

if TYPE_CHECKING:
    from rich.table import Table

TOUCHING = 0.02
"""A link touches within this distance (m), unless said otherwise."""
CLEAN = 0.01
"""A contact deeper than this (m) is not clean."""
SLIPPING = 0.01
"""A planted foot that moves faster than this (m/s) slips."""


@dataclass(frozen=True, eq=False)
class ReferenceReport:
    """Per-frame figures of a robot motion, exactly as in the definitions of ``evaluate``.

    Everything that needs the human source is empty or None where no source was given.

    Attributes:
        fps: Frames per second.
        penetration: ``"object"``, ``"terrain"``, ``"ground"``, ``"self"`` to (T,) depth of the
            deepest pair of geoms, m, 0 where nothing penetrates. A target that the scene lacks has
            no entry.
        joint_violation: (T,) largest excess over a mechanical joint range, rad.
        velocity_violation: (T,) largest excess over a joint speed limit, rad/s; the speed is that
            since the previous frame.
        joint_speed: (T,) largest joint speed since the previous frame, rad/s.
        joint_acceleration: (T,) root mean square over the joints, rad/s², second differences; NaN
            on the first and the last frame.
        joint_jerk: (T,) the same of third differences, rad/s³; NaN on frames 0, 1 and the last.
        slip: (T, 2) speed of the slowest sole point of each foot tangent to its support, m/s.
        stance: Mode to (T, 2) bool: foot and frame count as planted.
        drift: Mode to (T, 2) distance of the sole centre, tangent to its support, from its place at
            the start of the stance interval, m, NaN off stance.
        still_drift: Mode to (T, 2) the same since the human's foot last rolled or turned on its
            toes within the stance, NaN while it does: see ``stance_drift``.
        pivot_drift: Mode to (T, 2) the same of the sole point that moved least: what is left when
            rolling over heel or toe is not called drift.
        clearance: Mode to (T, 2) height of the farthest sole point over what is below the foot,
            median of the frames in a row on which the human stands flat, m; NaN on others: see
            ``stance_clearance``.
        contact: Link to (T,) bool: the source touches object or terrain.
        contact_distance: Link to (T,) signed distance of the link to that surface, m, infinite
            beyond reach.
        contact_depth: Link to (T,) depth of the link in any part of the surroundings, m.
        contact_gap: Link to (T,) distance from the point that the human touches to the link, m; NaN
            without contact or point.
        keypoint_error: (T,) mean distance of the robot's keypoints from the source's, m, or None.
        energy: (T,) deformation energy of the interaction mesh, weight 1, m², or None.
        relaxed: (T,) bool: the solver gave a constraint up, or None where no solver told.
    """

    fps: float
    penetration: Mapping[str, np.ndarray]
    joint_violation: np.ndarray
    velocity_violation: np.ndarray
    joint_speed: np.ndarray
    joint_acceleration: np.ndarray
    joint_jerk: np.ndarray
    slip: np.ndarray
    stance: Mapping[str, np.ndarray] = field(default_factory=dict)
    drift: Mapping[str, np.ndarray] = field(default_factory=dict)
    still_drift: Mapping[str, np.ndarray] = field(default_factory=dict)
    pivot_drift: Mapping[str, np.ndarray] = field(default_factory=dict)
    clearance: Mapping[str, np.ndarray] = field(default_factory=dict)
    contact: Mapping[str, np.ndarray] = field(default_factory=dict)
    contact_distance: Mapping[str, np.ndarray] = field(default_factory=dict)
    contact_depth: Mapping[str, np.ndarray] = field(default_factory=dict)
    contact_gap: Mapping[str, np.ndarray] = field(default_factory=dict)
    keypoint_error: np.ndarray | None = None
    energy: np.ndarray | None = None
    relaxed: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name, array in self.to_arrays().items():
            if name != "fps" and (array.ndim < 1 or len(array) != self.num_frames):
                raise InvalidDataError(
                    "ReferenceReport", name, f"({self.num_frames}, …)", str(array.shape)
                )

    @property
    def num_frames(self) -> int:
        """T."""
        return len(self.joint_violation)

    @property
    def surroundings_penetration(self) -> np.ndarray:
        """(T,) depth in object, terrain or ground, m."""
        depths = [depth for target, depth in self.penetration.items() if target != "self"]
        return np.max(depths, axis=0)

    def planted_slip(self, mode: str) -> np.ndarray | None:
        """Returns the slip of the foot-frames that count as planted in a stance set, m/s, flat."""
        return self.slip[self.stance[mode]] if mode in self.stance else None

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Returns all figures as flat arrays, ``from_arrays`` reads them back."""
        arrays: dict[str, np.ndarray] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, Mapping):
                arrays |= {f"{f.name}/{key}": np.asarray(array) for key, array in value.items()}
            elif value is not None:
                arrays[f.name] = np.asarray(value)
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> ReferenceReport:
        """Rebuilds a report from ``to_arrays``.

        Raises:
            InvalidDataError: A figure is missing or unknown.
        """
        known = {f.name for f in fields(cls)}
        values: dict[str, Any] = {}
        for name, array in arrays.items():
            head, _, key = name.partition("/")
            if head not in known:
                raise InvalidDataError(
                    "ReferenceReport", name, f"one of {sorted(known)}", "unknown"
                )
            if key:
                values.setdefault(head, {})[key] = array
            else:
                values[head] = float(array) if head == "fps" else array
        try:
            return cls(**values)
        except TypeError as error:
            raise InvalidDataError("ReferenceReport", "data", "complete", str(error)) from error

    def summary(self) -> dict[str, float | int | None]:
        """Returns the figures of the whole motion; None where one needs a source that is absent.

        See ``summarize`` for the definitions.
        """
        from omni_envs.metrics.summary import summarize

        return summarize(self)

    def details(self) -> dict[str, float | int | None]:
        """Returns all other figures: every column, threshold and link by itself."""
        from omni_envs.metrics.summary import details

        return details(self)

    def table(self, title: str = "") -> Table:
        """Returns summary and details as a table for people."""
        from omni_envs.metrics.summary import details, summarize, summary_table

        return summary_table({title or "value": summarize(self) | details(self)})
