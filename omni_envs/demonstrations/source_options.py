"""What a user says about a recording where its file does not."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf
from numbers import Real
from pathlib import Path
from typing import Literal, get_args

from omni_envs.demonstrations.resampling import FPS, whole_step
from omni_envs.errors import FileFormatError, InvalidValueError

UpAxis = Literal["x", "y", "z", "-x", "-y", "-z"]
"""Axis of the file that points up."""

Unit = Literal["m", "cm", "mm", "inch", "cmu"]
"""Length unit of the file; ``"cmu"`` is that of CMU's .amc files, 0.45⁻¹ inch."""

METRES: dict[Unit, float] = {
    "m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "cmu": 0.0254 / 0.45,
}  # fmt: skip
"""Metres per unit."""

MAX_FRAMES = 100_000
"""Frames of a file that are taken at most: 55 minutes at 30 fps, 14 minutes at 120."""

MIN_FPS, MAX_FPS = 5.0, 1000.0
"""Frame rates outside are taken for an error."""


@dataclass(frozen=True)
class SourceOptions:
    """What a user says about a recording.

    Attributes:
        height: Standing height of the person, m. None takes what the source says or shows.
        up: Axis of the file that points up. None finds it.
        unit: Length unit of the file. None finds it.
        fps: Frames per second of the recording. None takes what the file says.
        start: Beginning of the part to take, s. None is the first frame.
        end: End of the part to take, s, not included. None is the last frame.
        skeleton: Name of a known skeleton, or a YAML file (see ``SkeletonMap``). None recognises
            the joint names.
        body_model: SMPL body model, or a folder of these.
    """

    height: float | None = None
    up: UpAxis | None = None
    unit: Unit | None = None
    fps: float | None = None
    start: float | None = None
    end: float | None = None
    skeleton: str | Path | None = None
    body_model: str | Path | None = None

    def __post_init__(self) -> None:
        for name, expected, valid in (
            ("height", "between 0 and 3 m", lambda v: 0 < v < 3),
            ("fps", f"between {MIN_FPS:g} and {MAX_FPS:g}", lambda v: MIN_FPS <= v <= MAX_FPS),
            ("start", "seconds from 0 on", lambda v: 0 <= v < inf),
            ("end", "seconds from 0 on", lambda v: 0 <= v < inf),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, Real) or not valid(value):
                raise InvalidValueError(name, f"a number {expected}", value)
        for name, kind in (("up", UpAxis), ("unit", Unit)):
            value = getattr(self, name)
            if value is not None and value not in get_args(kind):
                raise InvalidValueError(name, f"one of {', '.join(get_args(kind))}", value)
        for name in ("skeleton", "body_model"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, str | Path):
                raise InvalidValueError(name, "the name of a file", value)
        if self.end is not None and self.end <= (self.start or 0.0):
            raise InvalidValueError("end", f"later than start, {self.start or 0.0:g} s", self.end)

    def frame_rate(self, path: Path, field: str, stated: float | None) -> float:
        """The frame rate to believe: the option, else what the file states.

        Raises:
            FileFormatError: There is neither, or the file states a rate that nobody records at.
        """
        if self.fps is not None:
            return self.fps
        if stated is None:
            raise FileFormatError(
                path, field, "frames per second, or the option fps (--fps-source)", "none"
            )
        # Half a percent of grace, for rates that were written with few digits.
        if not MIN_FPS * 0.995 <= stated <= MAX_FPS * 1.005:
            expected = (
                f"{MIN_FPS:g} to {MAX_FPS:g} frames per second, or the option fps (--fps-source)"
            )
            raise FileFormatError(path, field, expected, f"{stated:.6g} frames per second")
        # Frame times have six digits, if that: 0.008333 s is 120 fps.
        return float(round(stated)) if abs(stated - round(stated)) < 1e-4 * stated else stated

    def rows(self, path: Path, frames: int, fps: float) -> slice:
        """Frames to take of a recording, thinned where its rate is a multiple of 30.

        Args:
            path: The file, for error messages.
            frames: Frames in the file.
            fps: Their rate.

        Raises:
            FileFormatError: The part is empty, or longer than ``MAX_FRAMES``.
        """
        first = 0 if self.start is None else ceil(self.start * fps - 1e-6)
        last = frames if self.end is None else min(frames, ceil(self.end * fps - 1e-6))
        if first >= last:
            asked = f"a part within its {frames / fps:.6g} s ({frames} frames at {fps:.6g} fps)"
            found = f"start {self.start or 0:g} s, end {'none' if self.end is None else self.end}"
            raise FileFormatError(path, "start, end", asked, found)
        if last - first > MAX_FRAMES:
            expected = f"at most {MAX_FRAMES} frames; cut the file with the options start and end"
            raise FileFormatError(path, "frames", expected, f"{last - first}")
        return slice(first, last, whole_step(fps) or 1)


def kept_fps(fps: float) -> float:
    """Frame rate after ``SourceOptions.rows`` has thinned a recording."""
    return FPS if whole_step(fps) else fps
