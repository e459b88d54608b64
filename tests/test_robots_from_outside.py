"""Robots that other packages announce: found by name in every process, imported when asked for."""

import json
import os
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from omni_envs.errors import OmniEnvsError, UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.registration import GROUP, VARIABLE, announced_robots, environment_ids
from omni_envs.robots import G1, get_robot, register_robot, registry, robot_names

MODULE = """
from dataclasses import replace

from omni_envs.robots import G1

MINE = replace(G1, name="my_robot", title="My robot")
"""
MINE = replace(G1, name="my_robot", title="My robot")
IDS = [f"OmniEnvs/MyRobot{task}-v0" for task in ("BoxCarry", "Climb", "Crawl", "Track")]


@pytest.fixture
def package(tmp_path):
    """A folder with an installed package that announces a robot."""
    (tmp_path / "outside.py").write_text(MODULE)
    info = tmp_path / "outside-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: outside\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\nmy_robot = outside:MINE\n")
    return tmp_path


@pytest.fixture
def clean(monkeypatch):
    # Only what is built in: other tests register robots of their own.
    built_in = {name: registry._ROBOTS[name] for name in ("g1", "h1", "t1")}
    monkeypatch.setattr(registry, "_ROBOTS", built_in)
    ids = set(gymnasium.registry)
    yield
    for new in set(gymnasium.registry) - ids:
        del gymnasium.registry[new]


def run(package, *words):
    paths = [str(package), str(Path(__file__).parents[1])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, env=environment, cwd=package
    )


def test_a_package_announces_a_robot(package):
    reference = reference_from_qpos(MINE, 50.0, np.tile(MINE.default_qpos, (30, 1)))
    path = reference.save(package / "standing.npz")
    code = f"""
import sys, gymnasium, omni_envs
assert "outside" not in sys.modules and "mujoco" not in sys.modules
env = gymnasium.make("OmniEnvs/MyRobotTrack-v0", reference={str(path)!r})
env.reset(seed=0)
reward = env.step(env.action_space.sample())[1]
print(env.unwrapped.robot.title, reward)
"""
    done = run(package, "-c", code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("My robot ")
    listed = json.loads(run(package, "-m", "omni_envs.cli", "list", "--json").stdout)
    assert listed["robots"][-1] == "my_robot" and listed["environments"][-4:] == IDS
    judged = run(package, "-m", "omni_envs.cli", "evaluate", str(path), "--json")
    assert judged.returncode == 0 and json.loads(judged.stdout)["frames"] == 30


@pytest.mark.usefixtures("clean")
def test_a_registered_robot_has_environments():
    mine = register_robot(replace(MINE))
    reference = reference_from_qpos(mine, 50.0, np.tile(mine.default_qpos, (30, 1)))
    assert [env.id for env in environment_ids("my_robot")] == IDS
    env = gymnasium.make("OmniEnvs/MyRobotTrack-v0", reference=reference)
    assert env.unwrapped.robot is mine
    assert np.isfinite(env.reset(seed=0)[0]).all()
    envs = gymnasium.make_vec("OmniEnvs/MyRobotTrack-v0", num_envs=2, reference=reference)
    assert envs.reset(seed=0)[0].shape == (2, env.observation_space.shape[0])


@pytest.mark.usefixtures("clean")
def test_a_variable_announces_robots_without_a_package(package, monkeypatch):
    monkeypatch.syspath_prepend(str(package))
    monkeypatch.setenv(VARIABLE, " my_robot=outside:MINE , g1=outside:MINE")
    assert robot_names() == ("g1", "h1", "t1", "my_robot")
    assert get_robot("g1") is G1  # what is built in stays
    assert get_robot("My_Robot").title == "My robot"


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("nowhere:MINE", "ModuleNotFoundError"),
        ("outside:YOURS", "AttributeError"),
        ("outside:replace", "expected a Robot of that name; found function"),
        ("outside:G1", "expected a Robot of that name; found the robot 'g1'"),
    ],
)
@pytest.mark.usefixtures("clean")
def test_what_an_announcement_does_not_bring(package, monkeypatch, place, message):
    monkeypatch.syspath_prepend(str(package))
    monkeypatch.setenv(VARIABLE, f"my_robot={place}")
    with pytest.raises(OmniEnvsError, match=f"Robot 'my_robot', announced as {place} .*{message}"):
        get_robot("my_robot")
    with pytest.raises(UnknownNameError, match="my_robot"):  # among the valid ones
        get_robot("yours")


def test_an_announcement_that_cannot_be_read_is_left_out(monkeypatch):
    monkeypatch.setenv(VARIABLE, "outside,a=b:C,=")
    with pytest.warns(UserWarning, match="expected name=module:ROBOT"):
        assert [*announced_robots()] == ["a"]
    monkeypatch.setenv(VARIABLE, "")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert announced_robots() == {}
