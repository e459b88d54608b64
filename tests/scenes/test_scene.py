import json

import numpy as np
import pytest

from omni_envs.errors import InvalidDataError
from omni_envs.scenes import Box, ConvexMesh, Part, Scene, SceneObject, Terrain


def scene() -> Scene:
    box = Box((0.5, 0.5, 0.2)).mesh()
    platform = Part(ConvexMesh(np.array(box.vertices), np.array(box.faces)), (2.0, 0.0, 0.2))
    crate = SceneObject(
        "crate", (Part(Box((0.2, 0.15, 0.1))), Part(Box((0.05, 0.05, 0.05)), (0, 0, 0.15))), 1.5
    )
    return Scene(crate, Terrain((platform,)), ground_friction=0.9)


def test_dict_round_trip_through_json():
    data = scene().to_dict()
    assert Scene.from_dict(json.loads(json.dumps(data))).to_dict() == data


@pytest.mark.parametrize(
    "data",
    [{}, {"ground_friction": 1.0, "object": {"name": "x"}}, {"ground_friction": 1.0, "terrain": 3}],
)
def test_malformed_dict_is_refused(data):
    with pytest.raises(InvalidDataError, match="Scene"):
        Scene.from_dict(data)


def test_scaling_multiplies_the_volume():
    scaled = scene().object.scaled(np.array([2.0, 1.0, 1.0]))
    assert scaled.surface().volume == pytest.approx(2.0 * scene().object.surface().volume)
    low, _ = scene().terrain.scaled(0.5).surface().bounds
    np.testing.assert_allclose(low, [0.75, -0.25, 0.0], atol=1e-9)


def test_rotated_part_scales_in_the_frame_of_its_owner():
    turn = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
    rod = SceneObject("rod", (Part(Box((1.0, 0.1, 0.1)), (0, 0, 0), turn),))
    low, high = rod.scaled(np.array([1.0, 3.0, 1.0])).surface().bounds
    np.testing.assert_allclose(high - low, [0.2, 6.0, 0.2], atol=1e-9)


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan, np.inf])
def test_object_refuses_bad_mass(mass):
    with pytest.raises(InvalidDataError, match="mass"):
        SceneObject("x", (Part(Box((1, 1, 1))),), mass)


def test_object_needs_parts():
    with pytest.raises(InvalidDataError, match="parts"):
        SceneObject("x", ())
