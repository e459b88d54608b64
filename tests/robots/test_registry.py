"""The table of robots, and the recipe for a robot from outside the package."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from omni_envs.demonstrations import Demonstration, scale_demonstration
from omni_envs.errors import InvalidDataError, UnknownNameError
from omni_envs.metrics import evaluate
from omni_envs.retargeting import retarget
from omni_envs.robots import (
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


def limbs(side: str, y: float) -> str:
    """One leg of hip, knee and ankle, and one arm of shoulder and elbow."""
    return f"""
      <body name="{side}_thigh" pos="0 {y} -0.1">
        <joint name="{side}_hip" axis="0 1 0" range="-2 1"/>
        <geom name="{side}_thigh" size="0.03" fromto="0 0 -0.02 0 0 -0.13" mass="0.8"/>
        <body name="{side}_shin" pos="0 0 -0.15">
          <joint name="{side}_knee" axis="0 1 0" range="0 2.5"/>
          <geom name="{side}_shin" size="0.02" fromto="0 0 -0.03 0 0 -0.1" mass="0.4"/>
          <body name="{side}_foot" pos="0 0 -0.15">
            <joint name="{side}_ankle" axis="0 1 0" range="-1.2 0.6"/>
            <geom name="{side}_sole" type="box" size="0.08 0.03 0.01" pos="0.03 0 -0.02"/>
          </body>
        </body>
      </body>
      <body name="{side}_upper_arm" pos="0 {2 * y} 0.1">
        <joint name="{side}_shoulder" axis="0 1 0" range="-3 1"/>
        <geom name="{side}_upper_arm" size="0.02" fromto="0 0 0 0 0 -0.1" mass="0.3"/>
        <body name="{side}_forearm" pos="0 0 -0.12">
          <joint name="{side}_elbow" axis="0 1 0" range="-2.5 0"/>
          <geom name="{side}_forearm" size="0.02" fromto="0 0 -0.03 0 0 -0.1" mass="0.2"/>
        </body>
      </body>"""


TOY = f"""
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <default>
    <geom group="3" type="capsule"/>
  </default>
  <worldbody>
    <body name="trunk" pos="0 0 0.43">
      <freejoint/>
      <geom name="trunk" type="box" size="0.06 0.06 0.12" mass="3"/>
      {limbs("left", 0.08)}
      {limbs("right", -0.08)}
    </body>
  </worldbody>
</mujoco>
"""
JOINTS = ("hip", "knee", "ankle", "shoulder", "elbow")


def toy(path: Path, **changes: object) -> Robot:
    """A small robot described outside the package."""
    mjcf = path / "toy.xml"
    mjcf.write_text(TOY)
    sole = ((-0.05, 0.03, -0.03), (-0.05, -0.03, -0.03), (0.11, 0.03, -0.03), (0.11, -0.03, -0.03))
    links = {"hand": "forearm", "foot": "foot", "knee": "shin"}
    keypoints = {
        "hip": BodyPoint("thigh"),
        "knee": BodyPoint("shin"),
        "ankle": BodyPoint("foot"),
        "toe": BodyPoint("foot", (0.11, 0.0, -0.03)),
        "shoulder": BodyPoint("upper_arm"),
        "elbow": BodyPoint("forearm"),
        "hand": BodyPoint("forearm", (0.0, 0.0, -0.12)),
    }
    description: dict = {
        "name": "toy",
        "title": "Toy",
        "mjcf": mjcf,
        "height": 0.7,
        "root_body": "trunk",
        "anchor_body": "trunk",
        "torso_body": "trunk",
        "actuators": tuple(
            Actuator(f"{s}_{j}", 40.0, 2.0, 20.0, 10.0, 0.01) for s in SIDES for j in JOINTS
        ),
        "default_root_height": 0.43,
        "default_joint_positions": {},
        "keypoints": {
            "pelvis": BodyPoint("trunk"),
            **{
                f"{s}_{k}": replace(p, body=f"{s}_{p.body}")
                for s in SIDES
                for k, p in keypoints.items()
            },
        },
        "feet": {s: Foot(f"{s}_foot", (*sole, (0.11, 0.0, -0.03))) for s in SIDES},
        "contact_links": {f"{s}_{link}": (f"{s}_{b}",) for s in SIDES for link, b in links.items()},
        "tracked_bodies": ("trunk", "left_foot", "right_foot"),
        "end_effectors": ("left_foot", "right_foot"),
    }
    return Robot(**{**description, **changes})


def squat(robot: Robot, frames: int = 45) -> Demonstration:
    """Someone twice as tall, of the robot's proportions, squats and raises the hands."""
    down = 0.5 - 0.5 * np.cos(np.linspace(0.0, 2.0 * np.pi, frames))
    lengths = np.array([0.15, 0.15])
    data, points = mujoco.MjData(robot.model), []
    for bend in 0.7 * down:
        data.qpos[:] = robot.default_qpos
        data.qpos[2] = 0.13 + lengths.sum() * np.cos(bend)
        data.qpos[7:] = [*(-bend, 2.0 * bend, -bend), -bend, -bend] * 2
        mujoco.mj_kinematics(robot.model, data)
        points.append(
            [
                data.body(p.body).xpos + data.body(p.body).xmat.reshape(3, 3) @ p.offset
                for p in (robot.keypoints[k] for k in KEYPOINTS)
            ]
        )
    return Demonstration(
        name="squat",
        fps=30.0,
        joint_names=KEYPOINTS,
        positions=2.0 * np.array(points),
        keypoint_joints={k: k for k in KEYPOINTS},
        height=2.0 * robot.height,
    )


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
    assert (robot.nq, robot.nv) == (17, 16)
    assert robot.joint_names == tuple(f"{s}_{j}" for s in SIDES for j in JOINTS)
    model = build_spec(get_robot("toy"), Scene(), PhysicsOptions()).compile()
    data = mujoco.MjData(model)
    data.qpos[:] = robot.default_qpos
    data.qpos[2] += 0.005
    for _ in range(200):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.qpos[:3], (0.0, 0.0, 0.43), atol=0.01)


@pytest.mark.usefixtures("clean_table")
def test_a_robot_from_outside_follows_a_human(tmp_path: Path) -> None:
    robot = register_robot(toy(tmp_path))
    source = scale_demonstration(squat(robot), robot.height)
    motion = retarget(source, get_robot("toy"))
    assert (motion.robot, motion.qpos.shape) == ("toy", (45, robot.nq))
    lowest = motion.qpos[:, 2].min()
    assert motion.qpos[0, 2] == pytest.approx(0.43, abs=0.01)
    assert lowest == pytest.approx(0.13 + 0.3 * np.cos(0.7), abs=0.01)
    knee = motion.qpos[:, 7 + robot.joint_names.index("left_knee")]
    assert knee.max() == pytest.approx(1.4, abs=0.1)
    summary = evaluate(
        robot, source.scene, motion.fps, motion.qpos, motion.object_poses, source
    ).summary()
    assert summary["penetration_max_m"] < 1e-3
    assert summary["slip_fraction_default"] == 0.0
    assert summary["joint_violation_max_rad"] == 0.0


@pytest.mark.usefixtures("clean_table")
def test_names_are_taken_once(tmp_path: Path) -> None:
    register_robot(toy(tmp_path))
    with pytest.raises(InvalidDataError, match="name must be unused; got 'toy' twice"):
        register_robot(toy(tmp_path))
    with pytest.raises(InvalidDataError, match="'g1' twice"):
        register_robot(toy(tmp_path, name="g1"))
    assert get_robot("g1") is G1


@pytest.mark.parametrize("name", ["", "Toy", "my robot", "../toy", "1st"])
@pytest.mark.usefixtures("clean_table")
def test_names_are_lower_case(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidDataError, match="name must be lower-case letters"):
        register_robot(toy(tmp_path, name=name))
