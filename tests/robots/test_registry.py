"""The table of robots, and the recipe for a robot from outside the package."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from omni_envs.errors import InvalidDataError, UnknownNameError
from omni_envs.robots import (
    CONTACT_LINKS,
    G1,
    KEYPOINTS,
    SIDES,
    Actuator,
    BodyPoint,
    Foot,
    Robot,
    get_robot,
    register_robot,
    registry,
    robot_names,
)
from omni_envs.scenes import PhysicsOptions, Scene, build_spec

TOY = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <default>
    <geom group="3"/>
  </default>
  <worldbody>
    <body name="trunk" pos="0 0 0.4">
      <freejoint/>
      <geom name="trunk" type="box" size="0.1 0.1 0.1" mass="4"/>
      <body name="left" pos="0 0.1 -0.1">
        <joint name="left_hip" axis="0 1 0" range="-1 1"/>
        <geom name="left_leg" type="capsule" size="0.03" fromto="0 0 0 0 0 -0.2" mass="1"/>
        <geom name="left_sole" type="box" size="0.08 0.03 0.01" pos="0 0 -0.29" mass="0.2"/>
      </body>
      <body name="right" pos="0 -0.1 -0.1">
        <joint name="right_hip" axis="0 1 0" range="-1 1"/>
        <geom name="right_leg" type="capsule" size="0.03" fromto="0 0 0 0 0 -0.2" mass="1"/>
        <geom name="right_sole" type="box" size="0.08 0.03 0.01" pos="0 0 -0.29" mass="0.2"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def toy(path: Path, **changes: object) -> Robot:
    """A two-legged robot described outside the package."""
    mjcf = path / "toy.xml"
    mjcf.write_text(TOY)
    sole = ((-0.08, 0.03, -0.3), (-0.08, -0.03, -0.3), (0.08, 0.0, -0.3), (0.08, 0.0, -0.3))
    description: dict = {
        "name": "toy",
        "title": "Toy",
        "mjcf": mjcf,
        "height": 0.5,
        "root_body": "trunk",
        "anchor_body": "trunk",
        "torso_body": "trunk",
        "actuators": tuple(Actuator(f"{s}_hip", 40.0, 2.0, 20.0, 10.0, 0.01) for s in SIDES),
        "default_root_height": 0.4,
        "default_joint_positions": {},
        "keypoints": {k: BodyPoint("left" if k.startswith("left") else "trunk") for k in KEYPOINTS},
        "feet": {s: Foot(s, sole) for s in SIDES},
        "contact_links": {link: (link.split("_")[0],) for link in CONTACT_LINKS},
        "tracked_bodies": ("trunk", "left", "right"),
        "end_effectors": ("left", "right"),
    }
    return Robot(**{**description, **changes})


@pytest.fixture
def clean_table() -> Iterator[None]:
    before = dict(registry._ROBOTS)
    yield
    registry._ROBOTS.clear()
    registry._ROBOTS.update(before)


def test_finds_by_name_in_any_case_and_passes_robots_through() -> None:
    assert get_robot("g1") is G1
    assert get_robot("G1") is G1
    assert get_robot(G1) is G1
    assert "g1" in robot_names()


@pytest.mark.parametrize("name", ["g2", "", "unitree", 3])
def test_unknown_name_lists_the_valid_ones(name: object) -> None:
    with pytest.raises(UnknownNameError, match="Unknown robot") as caught:
        get_robot(name)  # type: ignore[arg-type]
    assert all(valid in str(caught.value) for valid in robot_names())


def test_close_name_is_suggested() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'g1'"):
        get_robot("g11")


@pytest.mark.usefixtures("clean_table")
def test_a_robot_from_outside_works_everywhere(tmp_path: Path) -> None:
    robot = register_robot(toy(tmp_path))
    assert register_robot(robot) is robot  # again is nothing
    assert get_robot("TOY") is robot
    assert robot_names()[-1] == "toy"
    assert (robot.nq, robot.nv, robot.joint_names) == (9, 8, ("left_hip", "right_hip"))
    model = build_spec(get_robot("toy"), Scene(), PhysicsOptions()).compile()
    data = mujoco.MjData(model)
    data.qpos[:] = robot.default_qpos
    data.qpos[2] += 0.005
    for _ in range(200):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.qpos[:3], (0.0, 0.0, 0.4), atol=0.01)


@pytest.mark.usefixtures("clean_table")
def test_names_are_taken_once(tmp_path: Path) -> None:
    register_robot(toy(tmp_path))
    with pytest.raises(InvalidDataError, match="name must be unused; got 'toy' twice"):
        register_robot(toy(tmp_path))
    with pytest.raises(InvalidDataError, match="'g1' twice"):
        register_robot(toy(tmp_path, name="g1"))
    assert get_robot("g1") is G1


@pytest.mark.parametrize("name", ["", "Toy"])
@pytest.mark.usefixtures("clean_table")
def test_names_are_lower_case(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidDataError, match="name must be lower-case"):
        register_robot(toy(tmp_path, name=name))
