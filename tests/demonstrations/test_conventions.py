from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations.conventions import (
    check_sides,
    estimate_height,
    find_unit,
    find_up,
    leg_length,
    rest_up,
    turn_up,
)
from omni_envs.demonstrations.source_options import METRES
from omni_envs.errors import FileFormatError
from omni_envs.robots import KEYPOINTS

CLIP = Path("clip")
NAMES = {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toe": "Toe", "shoulder": "Arm",
         "elbow": "ForeArm", "hand": "Hand"}  # fmt: skip


@pytest.fixture
def standing(person):
    """(T, 15, 3) keypoints of someone who stands and walks 2 m, z up, facing −y."""
    who = person()
    index = [who.names.index("Hips")]
    for keypoint in KEYPOINTS[1:]:
        side, part = keypoint.split("_")
        index.append(who.names.index(side.capitalize() + NAMES[part]))
    points = turn_up(who.pose()[0][:, index], "y")
    return points + np.linspace([0, 0, 0], [0, -2.0, 0], who.frames)[:, None]


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_every_axis_can_point_up(standing, up):
    """A rotation of the scene turns every file back: left stays left."""
    columns = turn_up(np.eye(3), up)
    assert np.linalg.det(columns) == pytest.approx(1.0)
    axis = {"x": 0, "y": 1, "z": 2}[up[-1]]
    np.testing.assert_array_equal(columns[axis], [0, 0, -1.0 if up[0] == "-" else 1.0])
    in_file = standing @ columns.T
    np.testing.assert_allclose(turn_up(in_file, up), standing, atol=1e-12)
    assert find_up(in_file, in_file, None, leg_length(in_file)) == up


def test_crawling_is_told_by_the_ground(standing):
    """Nobody upright, no rest skeleton: the lowest joint is constant along one axis only."""
    forward = np.array([[1, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # falls onto the front
    lying = (standing[:1] - standing[0, 0]) @ forward.T
    lying[:, [KEYPOINTS.index(f"{s}_shoulder") for s in ("left", "right")], 2] += 0.4
    travel = np.linspace([0, 0, 0], [0.0, -3.0, 0.0], 60)
    crawling = lying + travel[:, None]
    assert find_up(crawling, crawling, None, 0.85) == "z"
    # On the spot the recording does not tell, and the rest skeleton decides.
    still = lying + 0 * travel[:, None]
    assert find_up(still, still, standing[0], 0.85) == "z"


def test_lying_still_without_a_rest_skeleton_is_open(standing):
    flat = np.repeat(standing[:1], 10, axis=0) @ np.array(
        [[1, 0, 0], [0, 0.7, 0.7], [0, -0.7, 0.7]]
    )
    assert find_up(flat, flat, None, leg_length(flat)) is None


def test_rest_skeletons_of_bones_along_x_stand_nowhere(standing):
    assert rest_up(standing[0], 0.85) == "z"
    along = np.array(standing[0])
    order = np.argsort(np.abs(along[:, 2] - along[0, 2]))
    along[order] = np.linspace([0, 0, 0], [0.9, 0, 0], 15)
    assert rest_up(along, 0.85) is None


@pytest.mark.parametrize("unit", list(METRES))
def test_units_by_the_length_of_a_leg(unit):
    for leg in (0.56, 0.85, 1.09):
        assert find_unit(CLIP, leg / METRES[unit]) == unit
    with pytest.raises(
        FileFormatError, match=r"clip: unit of length.*\(mm\).*option unit; found 4"
    ):
        find_unit(CLIP, 4.0)


def test_left_and_right(standing):
    check_sides(CLIP, standing)
    with pytest.raises(FileFormatError, match=r"clip: left and right.*backwards on 100 %"):
        check_sides(CLIP, standing * [-1.0, 1.0, 1.0])


def test_height(standing):
    assert estimate_height(0.85) == pytest.approx(0.85 / 0.491)
    ankle = standing[0, KEYPOINTS.index("left_ankle"), 2]
    top = np.array([0.0, 0.0, ankle + 1.6])
    assert estimate_height(0.85, standing[0], top) == pytest.approx(1.69)
    # A crown that is only the neck, or a cartoon's head, is not believed.
    assert estimate_height(0.85, standing[0], top - [0, 0, 0.3]) == pytest.approx(0.85 / 0.491)
