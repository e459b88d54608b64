import numpy as np
import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.retargeting import RetargetOptions, deformation_energy, refine, retarget
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.retargeting.options import ORIENTED
from omni_envs.retargeting.orientation_task import OrientationTask, oriented_bodies
from omni_envs.robots import G1, get_robot

WEIGHTS = {"torso": 2.0, "hand": 1.0}


@pytest.fixture(scope="module")
def plain(grasp):
    return retarget(grasp, G1)


@pytest.fixture(scope="module")
def matched(grasp):
    return retarget(grasp, G1, RetargetOptions(orientation_weights=WEIGHTS))


def turns(motion):
    """(T,) value of the task."""
    configuration = Kinematics(G1, motion.source.scene)
    task = OrientationTask(motion.source.keypoints, configuration, WEIGHTS)
    values = []
    for t, q in enumerate(motion.qpos):
        configuration.update(q)
        task.set_frame(t)
        values.append(task.quadratic(configuration).value)
    return np.array(values)


def test_links_turn_as_the_human_turns_them(plain, matched):
    assert turns(matched).mean() < 0.7 * turns(plain).mean()
    # The mesh pays for it, and every constraint holds as before.
    assert matched.frames.energy.mean() > plain.frames.energy.mean()
    assert not matched.frames.relaxed.any()


def test_refinement_keeps_them_turned(plain, matched):
    after = refine(matched)
    assert turns(after).mean() < 1.1 * turns(matched).mean()
    energy = deformation_energy(after.source, G1, after.qpos)
    np.testing.assert_allclose(energy, after.frames.energy, rtol=1e-6)


def test_a_robot_in_its_default_pose_follows_a_human_in_that_pose():
    from omni_envs.scenes import Scene

    for name in ("g1", "h1", "t1"):
        robot = get_robot(name)
        configuration = Kinematics(robot, Scene())
        configuration.update(robot.default_qpos)
        keypoints = configuration.keypoints()[None].copy()
        task = OrientationTask(keypoints, configuration, dict.fromkeys(ORIENTED, 1.0))
        model = task.quadratic(configuration)
        assert model.value == pytest.approx(0.0, abs=1e-12)
        bodies = [b for pairs in oriented_bodies(robot).values() for b in pairs.values()]
        assert len(bodies) == 10 and set(bodies) <= set(robot.body_names)


@pytest.mark.parametrize("wrong", [{"head": 1.0}, {"torso": -1.0}])
def test_wrong_weights_are_refused(wrong):
    with pytest.raises(InvalidOptionError, match="orientation_weights"):
        RetargetOptions(orientation_weights=wrong)
