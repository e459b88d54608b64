import re

import numpy as np
import pytest

from omni_envs.demonstrations import (
    Variation,
    sample_variations,
    variation_grid,
)
from omni_envs.demonstrations.variation import HEIGHTS, POSES
from omni_envs.errors import InvalidOptionError


@pytest.mark.parametrize(
    ("field", "value", "expected"),
    [
        ("object_translation", (0.1,), "2 numbers"),
        ("object_translation", 0.1, "2 numbers"),
        ("object_translation", ("0.1", 0.2), "a number; got '0.1'"),
        ("object_translation", [[0.1], [0.1, 0.2]], r"a number; got \[0.1\]"),
        ("object_translation", (np.nan, 0), "a finite number"),
        ("object_translation", (200.0, 0), "at most 10 m"),
        ("object_yaw", "left", "a number; got 'left'"),
        ("object_yaw", None, "a number"),
        ("object_yaw", True, "a number"),
        ("object_yaw", 1j, "a number"),
        ("object_yaw", [0.1], "a number"),
        ("object_yaw", np.inf, "a finite number"),
        ("object_yaw", 10**400, "a finite number"),
        ("object_yaw", 45, "rad, at most"),
        ("object_scale", 1.1, "3 numbers"),
        ("object_scale", {"x": 1.1}, "3 numbers"),
        ("object_scale", (1, 0, 1), "0.1 to 10 times"),
        ("object_scale", (1, 1, -1), "0.1 to 10 times"),
        ("terrain_height", "tall", "a number"),
        ("terrain_height", -1.0, "0.1 to 10 times"),
        ("terrain_depth", 120, "0.1 to 10 times"),
        ("yaw_decay", 0.0, "seconds, more than 0"),
    ],
)
def test_bad_values_are_named(field, value, expected):
    with pytest.raises(InvalidOptionError, match=f"{field}: expected {expected}"):
        Variation(**{field: value})


def test_numbers_of_any_kind_make_equal_variations():
    given = Variation(np.array([0, np.float32(0.5)]), np.int64(1), [1, 1, 2], terrain_height=1)
    assert given == Variation((0.0, 0.5), 1.0, (1.0, 1.0, 2.0))
    assert all(type(v) is float for v in (*given.object_translation, given.object_yaw))


def test_grid_sampler_and_names():
    grid = list(variation_grid(terrain_height=(0.9, 1.1), object_yaw=(0.0, 0.5)))
    assert [(v.terrain_height, v.object_yaw) for v in grid] == [
        (0.9, 0.0), (0.9, 0.5), (1.1, 0.0), (1.1, 0.5),
    ]  # fmt: skip
    drawn = [
        sample_variations(
            50,
            np.random.default_rng(3),
            object_translation=((-0.2, -0.1), (0.2, 0.1)),
            terrain_depth=(0.9, 1.1),
        )
        for _ in range(2)
    ]
    assert drawn[0] == drawn[1]
    moves = np.array([v.object_translation for v in drawn[0]])
    assert (np.abs(moves) <= (0.2, 0.1)).all() and np.ptp(moves, axis=0).min() > 0.1
    names = [v.name for v in (*POSES, *HEIGHTS)]
    assert len(set(names)) == len(names) and Variation().name == "nominal"


def test_names_tell_apart_what_differs():
    assert Variation((0.1, 0), np.deg2rad(45)).name == "move_+0.10_+0.00_turn_+45"
    assert Variation(object_yaw=0.7854).name == "turn_+45"  # as written in recipes
    assert Variation(terrain_depth=0.9).name == "depth_0.90"
    drawn = sample_variations(
        2000,
        np.random.default_rng(0),
        object_yaw=(-0.1, 0.1),
        object_translation=((0.0, 0.0), (0.01, 0.01)),
    )
    faded = [Variation(object_yaw=0.1, **{n: 0.5}) for n in ("position_decay", "yaw_decay")]
    flat = [Variation(terrain_height=1.0 + 1e-3 * i) for i in range(1, 5)]
    names = [v.name for v in (*drawn, *faded, *flat, Variation(object_yaw=0.1), Variation())]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[\w+.-]{5,100}", name) for name in names)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"colour": ("red",)}, "colour: no field"),
        ({"terrain_height": 0.9}, "terrain_height: expected a list"),
        ({"terrain_height": "0.9"}, "terrain_height: expected a list"),
        ({"terrain_height": ()}, "at least one value"),
        ({"object_translation": (0, 1)}, "object_translation: expected 2 numbers"),
    ],
)
def test_bad_grids_are_named(values, expected):
    with pytest.raises(InvalidOptionError, match=expected):
        list(variation_grid(**values))


@pytest.mark.parametrize(
    ("count", "ranges", "expected"),
    [
        (-1, {}, "count: expected a whole number"),
        (1.5, {}, "count: expected a whole number"),
        (1, {"colour": (0, 1)}, "colour: no field"),
        (1, {"terrain_height": (2.0, 1.0)}, "lowest, highest"),
        (1, {"terrain_height": 1.0}, "lowest, highest"),
        (1, {"terrain_height": (1, 2, 3)}, "lowest, highest"),
        (1, {"terrain_height": ("low", "high")}, "a number; got 'low'"),
        (1, {"terrain_height": (-1, 1)}, "0.1 to 10 times"),
        (1, {"terrain_height": (1, np.nan)}, "a finite number"),
        (1, {"object_translation": ((0, 0), (1,))}, "2 numbers"),
        (1, {"object_scale": (0.9, 1.1)}, "3 numbers"),
    ],
)
def test_bad_ranges_are_named(count, ranges, expected):
    with pytest.raises(InvalidOptionError, match=expected):
        sample_variations(count, np.random.default_rng(0), **ranges)
