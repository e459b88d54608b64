import numpy as np
import pytest

from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.clip_program import ClipProgram
from omni_envs.retargeting.clip_restoration import restore_clip
from omni_envs.robots import G1

OPTIONS = RetargetOptions()


@pytest.fixture(scope="module")
def motion(grasp):
    return retarget(grasp, G1, OPTIONS)


@pytest.fixture
def program(motion):
    return ClipProgram(motion.source, G1, OPTIONS, 5e-6, motion.qpos)


def test_a_lawful_motion_stays(motion, program):
    before = motion.qpos.copy()
    restored = restore_clip(program, OPTIONS, motion.qpos)
    np.testing.assert_allclose(restored.qpos, before, atol=5e-3)
    np.testing.assert_array_equal(motion.qpos, before)
    assert not restored.relaxed.any()
    np.testing.assert_allclose(restored.energy, motion.frames.energy, rtol=0.01)


def test_a_motion_in_the_ground_and_too_fast_is_moved_onto_its_constraints(motion, program):
    sunk = motion.qpos.copy()
    sunk[:, 2] -= 0.005
    elbow = 7 + G1.joint_names.index("left_elbow_joint")
    sunk[10, elbow] += 1.5
    assert program.depths(sunk, 0, len(sunk)).max() > 0.004
    restored = restore_clip(program, OPTIONS, sunk)
    assert program.depths(restored.qpos, 0, len(sunk)).max() <= OPTIONS.restoration_tolerance
    assert not restored.relaxed.any() and restored.steps.sum() >= len(sunk)
    speed = np.abs(np.diff(restored.qpos[:, 7:], axis=0)) * motion.fps
    assert (speed <= G1.velocity_limits).all()
    low, high = G1.reference_joint_ranges.T
    assert (restored.qpos[:, 7:] >= low).all() and (restored.qpos[:, 7:] <= high).all()


def test_what_cannot_be_restored_is_told(motion, program):
    torn = motion.qpos.copy()
    torn[20:22, 2] += 0.4  # both feet are to stand
    restored = restore_clip(program, OPTIONS, torn)
    assert restored.relaxed[20:22].any()
    np.testing.assert_array_equal(restored.relaxed, (restored.violations > 2e-4).any(axis=1))


def test_progress_goes_on_after_the_rounds_before(motion, program):
    calls = []
    restore_clip(program, OPTIONS, motion.qpos, lambda *call: calls.append(call), rounds_before=3)
    frames = motion.num_frames
    assert calls[0] == (3 * frames + 1, 4 * frames) and calls[-1] == (4 * frames, 4 * frames)
