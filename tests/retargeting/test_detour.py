import numpy as np
import pytest

from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.detour import _share, led_around
from omni_envs.retargeting.tangents import motion_steps, moved
from omni_envs.robots import G1

OPTIONS = RetargetOptions(contact_weight=0.0)


@pytest.fixture(scope="module")
def motion(box_carry, cut):
    return retarget(cut(box_carry, 20, 150), G1, OPTIONS)


@pytest.fixture(scope="module")
def program(motion):
    return ClipProgram(motion.source, G1, OPTIONS, 5e-6, motion.qpos)


def smoothed(motion, depth):
    """The motion, with the left hand swung smoothly into the body about frame 50."""
    bump = depth * np.exp(-0.5 * ((np.arange(motion.num_frames) - 50) / 3.0) ** 2)
    x = np.zeros((motion.num_frames, G1.nv))
    x[:, 6 + G1.joint_names.index("left_shoulder_yaw_joint")] = -bump
    x[:, 6 + G1.joint_names.index("left_elbow_joint")] = -bump
    return moved(motion.qpos, x)


def test_a_lawful_motion_is_left_alone(motion, program):
    assert program.depths(motion.qpos, 0, 130).max() < 1e-4
    after = led_around(program, motion.qpos, motion.qpos, 1e-5)
    np.testing.assert_array_equal(after, motion.qpos)


def test_a_limb_moved_into_the_body_gets_out_smoothly(motion, program):
    inside = smoothed(motion, 1.5)
    assert program.depths(inside, 0, 130).max() > 0.01
    after = led_around(program, motion.qpos, inside, 1e-5)
    assert program.depths(after, 0, 130).max() <= 2e-3
    # It is as smooth as what it was made from, and the rest of the clip is as it was.
    roughness = [np.abs(np.diff(motion_steps(q), axis=0)).max() for q in (motion.qpos, after)]
    assert roughness[1] <= roughness[0]
    np.testing.assert_allclose(after[:5], inside[:5], atol=1e-12)
    np.testing.assert_allclose(after[-20:], inside[-20:], atol=1e-12)


def test_the_share_of_the_smoothing_falls_to_nothing_on_the_frames():
    frames = np.array([5, 6, 40])
    share = _share(60, frames)
    far = np.abs(np.arange(60)[:, None] - frames).min(axis=1)
    assert (share[far <= 1] == 0.0).all() and (share[far >= 9] == 1.0).all()
    order = np.argsort(far, kind="stable")
    assert (np.diff(share[order]) >= 0.0).all()
    assert (_share(60, frames[:0]) == 1.0).all()
