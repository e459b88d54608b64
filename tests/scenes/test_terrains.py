import json

import mujoco
import numpy as np
import pytest

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.robots import G1
from omni_envs.scenes import (
    Box,
    PhysicsOptions,
    Scene,
    build_spec,
    mesh_terrain,
    platform,
    slope_onto_block,
    stacked_platforms,
    uneven_ground,
)

SCENES = {
    "platform": platform(1.2, 1.0, edge=0.5),
    "stack": stacked_platforms([(0.2, 0.4), (0.5, 0.3), (0.1, 1.0)], edge=-1.0),
    "slope": slope_onto_block(np.deg2rad(15), 0.4, 1.0, foot=0.3),
    "uneven": uneven_ground(0.1 + 0.1 * np.random.default_rng(0).random((6, 8)), (3.0, 2.0)),
}


@pytest.mark.parametrize("name", SCENES)
def test_compiles_both_ways_and_survives_json(name):
    scene = SCENES[name]
    for physics in (None, PhysicsOptions()):
        model = build_spec(G1, scene, physics).compile()
        assert any(model.geom(i).name.startswith("terrain") for i in range(model.ngeom))
    again = Scene.from_dict(json.loads(json.dumps(scene.to_dict())))
    assert again.to_dict() == scene.to_dict()
    np.testing.assert_allclose(again.terrain.surface().bounds, scene.terrain.surface().bounds)


@pytest.mark.parametrize("name", SCENES)
def test_scales_with_the_person_about_the_origin(name):
    terrain = SCENES[name].terrain
    np.testing.assert_allclose(
        terrain.scaled(0.75).surface().bounds, 0.75 * terrain.surface().bounds, atol=1e-9
    )


def ground_under(scene, xy):
    """Height of what lies under a place, by a ray from above."""
    model = build_spec(None, scene).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geom = np.zeros(1, np.int32)
    far = mujoco.mj_ray(
        model, data, np.array([*xy, 5.0]), np.array([0, 0, -1.0]), None, 1, -1, geom, None
    )
    return 5.0 - far


def test_tops_are_where_asked():
    assert ground_under(SCENES["platform"], (0.52, 0.7)) == pytest.approx(1.2)
    assert ground_under(SCENES["platform"], (0.48, 0.0)) == pytest.approx(0.0)
    for x, height in ((-0.8, 0.2), (-0.45, 0.5), (0.0, 0.1), (0.75, 0.0)):
        assert ground_under(SCENES["stack"], (x, 0.1)) == pytest.approx(height)
    rise = np.tan(np.deg2rad(15))
    for x in (0.4, 1.0, 1.5):
        assert ground_under(SCENES["slope"], (x, 0.2)) == pytest.approx((x - 0.3) * rise, abs=1e-6)
    assert ground_under(SCENES["slope"], (0.3 + 0.4 / rise + 0.5, 0)) == pytest.approx(0.4)
    field = SCENES["uneven"].terrain.heightfield
    for x, y in ((0.3, 0.2), (-1.1, 0.77)):
        expected = field.height_at(np.array([[x, y]]))[0]
        assert ground_under(SCENES["uneven"], (x, y)) == pytest.approx(expected, abs=1e-6)


def test_every_part_is_closed_and_outward():
    for scene in SCENES.values():
        for part in scene.terrain.parts:
            assert part.mesh().is_watertight and part.mesh().volume > 0


def test_mesh_terrain_joins_files(tmp_path):
    for name in "ab":
        Box((0.2, 0.3, 0.1)).mesh().export(tmp_path / f"{name}.obj")
    assert len(mesh_terrain(tmp_path / "a.obj", tmp_path / "b.obj").terrain.parts) == 2
    with pytest.raises(InvalidDataError, match="parts"):
        mesh_terrain()
    with pytest.raises(FileFormatError, match=r"none\.obj"):
        mesh_terrain(tmp_path / "none.obj")


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: platform(0.0, 1.0), "height"),
        (lambda: platform(1.0, -1.0), "depth"),
        (lambda: platform(1.0, 1.0, width=np.nan), "width"),
        (lambda: platform(1.0, 1.0, edge=np.inf), "edge"),
        (lambda: stacked_platforms([]), "steps"),
        (lambda: stacked_platforms([(1.0, 1.0), (1.0,)]), r"steps\[1\]"),
        (lambda: slope_onto_block(0.0, 1.0, 1.0), "angle"),
        (lambda: slope_onto_block(np.nan, 1.0, 1.0), "angle"),
        (lambda: slope_onto_block(0.2, np.nan, 1.0), "height"),
        (lambda: slope_onto_block(0.2, 1.0, 1.0, foot=np.nan), "foot"),
        (lambda: uneven_ground(np.zeros((1, 1)), (1, 1)), "heights"),
    ],
)
def test_bad_numbers_are_refused(make, field):
    with pytest.raises(InvalidDataError, match=field):
        make()
