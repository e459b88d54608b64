"""Sources that the tests of retargeting share: short, made on the spot, quick to solve."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import (
    builtin_demonstration,
    load_demonstration,
    scale_demonstration,
)
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.robots import G1


def cut_source(source: SourceMotion, start: int, stop: int) -> SourceMotion:
    """Frames [start, stop) of a source."""
    part = slice(start, stop)

    def some(array):
        return None if array is None else np.asarray(array)[part]

    return replace(
        source,
        keypoints=source.keypoints[part],
        object_poses=some(source.object_poses),
        source_object_poses=some(source.source_object_poses),
        stance={mode: flags[part] for mode, flags in source.stance.items()},
        contacts={link: flags[part] for link, flags in source.contacts.items()},
        contact_points={link: points[part] for link, points in source.contact_points.items()},
    )


@pytest.fixture(scope="session")
def box_carry() -> SourceMotion:
    """The built-in box carry at the scale of the G1."""
    return scale_demonstration(builtin_demonstration("box_carry"), G1.height)


@pytest.fixture(scope="session")
def grasp(box_carry) -> SourceMotion:
    """60 frames of it: from before the first touch of the box into the carry."""
    first = int(np.flatnonzero(box_carry.contacts["left_hand"])[0])
    return cut_source(box_carry, max(first - 20, 0), first + 40)


@pytest.fixture(scope="session")
def cut():
    """``cut(source, start, stop)``: frames of a source."""
    return cut_source


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of recordings to measure on; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("OMNI_ENVS_SHARED", Path(__file__).parents[3] / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("recordings to measure on are not here (set OMNI_ENVS_SHARED)")
    return folder


@pytest.fixture(scope="session")
def largebox(shared) -> SourceMotion:
    """The OMOMO clip that the official retargeter is compared on, at the scale of the G1."""
    folder = shared / "data" / "omomo"
    clip = load_demonstration(folder / "sub3_largebox_003.pt", object_mesh=folder / "largebox.obj")
    return scale_demonstration(clip, G1.height)
