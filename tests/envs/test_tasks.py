from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration, builtin_names
from omni_envs.envs import OmniEnv, OmniVectorEnv
from omni_envs.envs.task import TrackingTask
from omni_envs.envs.tasks import TASKS, get_task
from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.references import make_reference
from omni_envs.registration import ENVIRONMENTS
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import CONTACT_LINKS
from omni_envs.tracking.rewards import TRACKING_TERMS


def test_every_task_has_ids_and_its_demonstration():
    assert {(e.task, e.task_label) for e in ENVIRONMENTS} == {
        (t.name, t.label) for t in TASKS.values()
    }
    for task in TASKS.values():
        assert task.demonstration is None or task.demonstration in builtin_names()
        assert set(task.supports) <= set(CONTACT_LINKS)
        assert f"| {task.label}" in OmniEnv.__doc__
    with pytest.raises(UnknownNameError, match=r"'clim'.*climb"):
        get_task("clim")


def test_track_needs_a_reference_and_takes_any(reference):
    with pytest.raises(InvalidOptionError, match="'track' tracks what it is given"):
        OmniEnv(task="track")
    assert OmniEnv(task="track", reference=reference).references[0] is reference


def test_knees_may_touch_where_the_task_leans_on_them(reference):
    def watched(**options):
        env = OmniVectorEnv(1, reference=reference, preset="beyondmimic", num_threads=1, **options)
        return env.config.reward.may_touch, env.simulation._env_model.contact_bodies

    assert "left_knee_link" in watched(task="box_carry")[1]
    links, bodies = watched(task="climb")
    assert "left_knee" in links and "left_knee_link" not in bodies
    assert "torso_link" in bodies and "left_elbow_link" in bodies
    own = watched(task="climb", reward={"may_touch": ["left_foot"]})[1]
    assert {"left_knee_link", "right_ankle_roll_link", "left_wrist_yaw_link"} <= set(own)
    assert "left_ankle_roll_link" not in own
    with pytest.raises(UnknownNameError, match="left_tail"):
        watched(reward={"may_touch": ["left_tail"]})


def part(name, start, stop):
    """Some seconds of a built-in demonstration."""
    demo = builtin_demonstration(name)
    cut = slice(round(start * demo.fps), round(stop * demo.fps))
    poses = None if demo.object_poses is None else demo.object_poses[cut]
    contacts = {link: flags[cut] for link, flags in demo.contacts.items()}
    return replace(demo, positions=demo.positions[cut], object_poses=poses, contacts=contacts)


@pytest.mark.parametrize("robot", ["g1", "h1", "t1"])
@pytest.mark.parametrize(
    ("task", "start", "stop"),
    [(t.name, *(4.0, 5.0)) for t in TASKS.values() if t.demonstration is not None],
)
def test_playback_earns_every_tracking_term_in_full(robot, task, start, stop, quiet):
    """Every robot and task: placed on its reference, the robot misses nothing."""
    demo = part(TASKS[task].demonstration, start, stop)
    reference = make_reference(demo, robot, options=RetargetOptions(refine=False))
    assert reference.report.surroundings_penetration.max() < 1e-3
    env = OmniVectorEnv(12, robot=robot, task=task, reference=reference, num_threads=1, **quiet)
    frames = np.linspace(1, reference.num_frames - 3, 12).astype(int)
    env.reset(seed=0, options={"motion": 0, "frame": frames})
    assert env.num_envs == 12 and env.single_action_space.shape == (env.robot.num_joints,)
    expected = env._library.frames(frames)
    action, forces = np.zeros((12, env.robot.num_joints)), np.zeros((12, 1, 4, 3))
    state = env.simulation
    judge = TrackingTask(env.robot, env.config, reference.object_poses is not None).judge
    judged = judge(state.qpos, state.bodies(), expected, action, action, forces, True)
    terms = [n for n in TRACKING_TERMS if n in judged.terms]
    assert len(terms) == (8 if reference.object_poses is not None else 6)
    for name in terms:
        weight = getattr(env.config.reward, name).weight
        np.testing.assert_allclose(judged.terms[name] / (weight * 0.02), 1.0, atol=1e-6)
    assert not any(test.any() for test in judged.tests.values())
    env.step(np.zeros((12, env.robot.num_joints)))
