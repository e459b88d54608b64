"""Augmentation: the same human motion with another object or terrain (OmniRetarget, section III-B).

A variation changes the *target* scene of a source motion. The source keeps its interaction mesh, so
minimising the deformation carries the interaction over to the changed scene.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any

import numpy as np

from omni_envs.errors import InvalidOptionError, InvalidValueError

_FURTHEST = 10.0
"""Metres by which an object may start elsewhere; more is a unit mistaken."""

_SMALLEST, _LARGEST = 0.1, 10.0
"""Sizes of an object or a terrain, of that of the demonstration; more is a unit mistaken."""


@dataclass(frozen=True)
class Variation:
    """How a scene differs from that of the demonstration.

    Attributes:
        object_translation: Where the object starts instead: m forward and m to the left, seen from
            the human who faces it on the first frame.
        object_yaw: Turn of the object about the vertical at the start, rad, at most one turn.
        object_scale: Size of the object along its own axes, 0.1 to 10.
        terrain_height: Height of the terrain, of that of the demonstration, 0.1 to 10.
        terrain_depth: Depth of the terrain, away from the edge that the human comes to, likewise.
        position_decay: Time in which the shift falls to 1/e once the object moves, s
            (OmniRetarget: 50 frames at 30 fps).
        yaw_decay: The same for the turn, s (OmniRetarget: 25 frames).

    Raises:
        InvalidOptionError: A value is not a number, or outside of its range.
    """

    object_translation: tuple[float, float] = (0.0, 0.0)
    object_yaw: float = 0.0
    object_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    terrain_height: float = 1.0
    terrain_depth: float = 1.0
    position_decay: float = 50.0 / 30.0
    yaw_decay: float = 25.0 / 30.0

    def __post_init__(self) -> None:
        for field in fields(self):
            given, default = getattr(self, field.name), field.default
            if isinstance(default, tuple):
                value: Any = _numbers(field.name, given, len(default))
            else:
                value = _number(field.name, given)
            object.__setattr__(self, field.name, value)
        if max(map(abs, self.object_translation)) > _FURTHEST:
            raise InvalidValueError(
                "object_translation", f"at most {_FURTHEST:g} m", self.object_translation
            )
        if abs(self.object_yaw) > 2.0 * np.pi:
            turn = f"rad, at most 2π = 6.28 (45° are {np.pi / 4:.4f})"
            raise InvalidValueError("object_yaw", turn, self.object_yaw)
        for name in ("object_scale", "terrain_height", "terrain_depth"):
            sizes = np.atleast_1d(getattr(self, name))
            if sizes.min() < _SMALLEST or sizes.max() > _LARGEST:
                times = f"{_SMALLEST:g} to {_LARGEST:g} times the demonstration's size"
                raise InvalidValueError(name, times, getattr(self, name))
        for name in ("position_decay", "yaw_decay"):
            if getattr(self, name) <= 0.0:
                raise InvalidValueError(name, "seconds, more than 0", getattr(self, name))

    @property
    def moves_object(self) -> bool:
        """Whether the object starts elsewhere."""
        return any(self.object_translation) or self.object_yaw != 0.0

    @property
    def shapes_object(self) -> bool:
        """Whether the object has another size."""
        return self.object_scale != (1.0, 1.0, 1.0)

    @property
    def shapes_terrain(self) -> bool:
        """Whether the terrain has another size."""
        return (self.terrain_height, self.terrain_depth) != (1.0, 1.0)

    @property
    def name(self) -> str:
        """What is different, for file names; ``"nominal"`` where nothing is."""
        words: list[str] = []
        said: dict[str, Any] = {f.name: f.default for f in fields(self)}
        if any(self.object_translation):
            said["object_translation"] = _rounded(self.object_translation, 2)
            words.append("move_" + "_".join(f"{v:+.2f}" for v in self.object_translation))
        if self.object_yaw:
            degrees = round(np.rad2deg(self.object_yaw))
            said["object_yaw"] = float(np.deg2rad(degrees))
            words.append(f"turn_{degrees:+d}")
        if self.shapes_object:
            said["object_scale"] = _rounded(self.object_scale, 2)
            words.append("size_" + "_".join(f"{v:.2f}" for v in self.object_scale))
        for label, field in (("height", "terrain_height"), ("depth", "terrain_depth")):
            value = getattr(self, field)
            if value != 1.0:
                said[field] = round(value, 2)
                words.append(f"{label}_{value:.2f}")
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        # What the words do not tell, as of random draws, a few letters tell apart.
        if any(np.abs(np.subtract(values[name], said[name])).max() > 1e-5 for name in values):
            words.append(hashlib.sha256(repr(values).encode()).hexdigest()[:10])
        return "_".join(words) or "nominal"


def variation_grid(**values: Sequence[Any]) -> Iterator[Variation]:
    """Yields all combinations, e.g. ``variation_grid(terrain_height=(0.9, 1), object_yaw=(0, 1))``.

    Raises:
        InvalidOptionError: No such field, no list of values, or a value that the field cannot have.
    """
    _check_names(values)
    for name, choices in values.items():
        if not isinstance(choices, list | tuple | np.ndarray) or not len(choices):
            raise InvalidValueError(name, "a list of at least one value", choices)
    for combination in itertools.product(*values.values()):
        yield Variation(**dict(zip(values, combination, strict=True)))


def sample_variations(
    count: int, rng: np.random.Generator, **ranges: tuple[Any, Any]
) -> list[Variation]:
    """Returns random variations, uniform in each range.

    Args:
        count: How many.
        rng: Source of randomness.
        **ranges: Field to (lowest, highest), per component where the field has several.

    Raises:
        InvalidOptionError: No such field, a range that is none, or a count that does not count.
    """
    if isinstance(count, bool) or not isinstance(count, Integral) or count < 0:
        raise InvalidValueError("count", "a whole number from 0 on", count)
    _check_names(ranges)
    limits = {}
    for name, given in ranges.items():
        if not isinstance(given, list | tuple | np.ndarray) or len(given) != 2:
            raise InvalidValueError(name, "(lowest, highest)", given)
        # The field itself says what may be its lowest and its highest value.
        low, high = (getattr(Variation(**{name: end}), name) for end in given)
        if np.any(np.greater(low, high)):
            raise InvalidValueError(name, "(lowest, highest)", given)
        limits[name] = low, high

    def draw(low: Any, high: Any) -> Any:
        value = rng.uniform(low, high)
        return float(value) if np.ndim(value) == 0 else tuple(float(v) for v in value)

    return [Variation(**{k: draw(*v) for k, v in limits.items()}) for _ in range(int(count))]


def _number(name: str, value: Any) -> float:
    # A number of any library, but neither True nor "1", which YAML writes for something else.
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise InvalidValueError(name, "a number", value)
    try:
        number = float(value)
    except OverflowError:
        number = np.inf
    if not np.isfinite(number):
        raise InvalidValueError(name, "a finite number", value)
    return number


def _numbers(name: str, values: Any, count: int) -> tuple[float, ...]:
    if not isinstance(values, list | tuple | np.ndarray) or len(values) != count:
        raise InvalidValueError(name, f"{count} numbers", values)
    return tuple(_number(name, value) for value in values)


def _rounded(values: tuple[float, ...], digits: int) -> tuple[float, ...]:
    return tuple(round(value, digits) for value in values)


def _check_names(values: Mapping[str, Any]) -> None:
    valid = [f.name for f in fields(Variation)]
    for name in values:
        if name not in valid:
            raise InvalidOptionError(f"{name}: no field of a variation; fields: {valid}.")


POSES = tuple(
    Variation(object_translation=(x, y), object_yaw=float(np.deg2rad(yaw)))
    for x, y, yaw in ((0.2, 0, 0), (0, 0.2, 0), (0, -0.2, 0), (0, 0.2, 45), (0, -0.2, -45))
)
"""The five starts of the object in OmniRetarget's dataset: moved by 0.2 m, or moved and turned."""

HEIGHTS = tuple(Variation(terrain_height=h) for h in (0.8, 0.9, 1.0, 1.1, 1.2))
"""The five heights of a terrain in OmniRetarget's dataset."""
