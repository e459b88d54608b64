import sys
from dataclasses import replace

import numpy as np
import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.metrics import evaluate
from omni_envs.retargeting import (
    RefineOptions,
    RetargetOptions,
    StanceOptions,
    deformation_energy,
    refine,
    retarget,
)
from omni_envs.robots import G1


def figures(motion):
    return evaluate(
        G1,
        motion.source.scene,
        motion.fps,
        motion.qpos,
        motion.object_poses,
        motion.source,
        relaxed=motion.frames.relaxed,
    ).summary()


def check_bars(before, after):
    """What a refinement promises about the figures of a motion."""
    assert after["joint_acceleration_rms"] <= 0.6 * before["joint_acceleration_rms"]
    assert after["energy_mean"] <= 1.03 * before["energy_mean"]
    assert after["energy_max"] <= 1.10 * before["energy_max"]
    assert after["penetration_max_m"] <= 1e-3 and after["self_penetration_max_m"] <= 1e-3
    assert after["joint_violation_max_rad"] == 0.0
    assert after["velocity_violation_max_rad_s"] == 0.0
    assert after["slip_fraction_text"] <= 0.01 and after["slip_fraction_default"] <= 0.01
    assert after["slip_max_code_m_s"] <= 0.10
    assert after["stance_drift_max_m"] <= max(2e-3, before["stance_drift_max_m"])
    assert after["contact_clean_fraction"] >= min(0.98, before["contact_clean_fraction"])
    assert after["contact_point_gap_mean_m"] <= max(0.02, before["contact_point_gap_mean_m"])
    assert after["relaxed_frames"] <= before["relaxed_frames"]


@pytest.fixture(scope="module")
def plain(box_carry):
    return retarget(box_carry, G1)


@pytest.fixture(scope="module")
def refined(plain):
    return refine(plain)


@pytest.fixture(scope="module")
def short(grasp):
    return retarget(grasp, G1)


def test_smoother_under_the_same_constraints(plain, refined):
    check_bars(figures(plain), figures(refined))


def test_the_record_is_of_the_refined_motion(plain, refined):
    energy = deformation_energy(refined.source, G1, refined.qpos, refined.options)
    np.testing.assert_allclose(energy, refined.frames.energy, rtol=1e-6)
    assert refined.frames.seconds.sum() > plain.frames.seconds.sum()
    assert (refined.frames.iterations >= plain.frames.iterations).all()
    assert set(refined.frames.violations) == set(plain.frames.violations)
    assert refined.source is plain.source and refined.options is plain.options
    np.testing.assert_allclose(np.linalg.norm(refined.qpos[:, 3:7], axis=1), 1.0, atol=1e-9)


def test_deterministic_and_leaves_its_input_alone(short):
    qpos = short.qpos.copy()
    np.testing.assert_array_equal(refine(short).qpos, refine(short).qpos)
    np.testing.assert_array_equal(short.qpos, qpos)


def test_progress_counts_every_round(short):
    calls = []
    refine(short, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (240, 240)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_more_weight_is_smoother(short):
    rms = [
        figures(refine(short, RefineOptions(acceleration_weight=weight)))["joint_acceleration_rms"]
        for weight in (1e-7, 5e-6, 1e-4)
    ]
    assert rms[0] > 1.2 * rms[1] > 1.44 * rms[2]


def test_windows_of_a_long_clip_meet(short, monkeypatch):
    whole = refine(short)
    # The package's attribute of that name is the function.
    monkeypatch.setattr(sys.modules["omni_envs.retargeting.refine"], "_WINDOW", 20)
    parts = refine(short)
    assert np.abs(parts.qpos - whole.qpos).max() < 0.03
    ratio = figures(parts)["joint_acceleration_rms"] / figures(whole)["joint_acceleration_rms"]
    assert ratio < 1.05


def test_speed_limits_that_bind_still_hold(short):
    options = RetargetOptions(velocity_limits=0.03)
    after = refine(retarget(short.source, G1, options))
    speed = np.abs(np.diff(after.qpos[:, 7:], axis=0)) * after.fps / G1.velocity_limits
    assert speed.max() <= 0.03
    assert speed.max() > 0.029  # they do bind


def test_contradictions_are_reported_and_limits_hold(short):
    poses = short.source.object_poses.copy()
    poses[:, 0] += 0.3 * np.sin(np.arange(len(poses)) * 2 * np.pi / 20)
    before = retarget(replace(short.source, object_poses=poses), G1)
    after = refine(before)
    assert before.frames.relaxed.any()
    summary = figures(after)
    assert np.isfinite(after.qpos).all()
    assert summary["joint_violation_max_rad"] == 0.0
    assert summary["velocity_violation_max_rad_s"] == 0.0
    for name, old in before.frames.violations.items():
        new = after.frames.violations[name]
        assert new[~after.frames.relaxed].max(initial=0.0) <= 2e-4
        assert name != "stance" or (new >= old).all()  # what was missed is still said


def test_without_stance_and_speed_limits(short):
    options = RetargetOptions(
        stance=StanceOptions(anchored=None, loose=None),
        velocity_limits=None,
        self_collision=False,
        contact_weight=0.0,
    )
    before = retarget(short.source, G1, options)
    after = refine(before)
    assert np.square(np.diff(after.qpos[:, 7:], 2, axis=0)).sum() < 0.5 * (
        np.square(np.diff(before.qpos[:, 7:], 2, axis=0)).sum()
    )


def test_a_motion_that_cannot_be_restored_goes_back(short, monkeypatch):
    module = sys.modules["omni_envs.retargeting.refine"]  # the package's attribute is the function
    solve = module.solve_clip_qp

    def torn(*arguments):
        solution = solve(*arguments)
        solution.x[20:22, 2] += 0.4  # into the air, off both feet
        return solution

    monkeypatch.setattr(module, "solve_clip_qp", torn)
    after = refine(short)
    assert not after.frames.relaxed.any()
    assert np.abs(after.qpos[:, 2] - short.qpos[:, 2]).max() < 0.05
    monkeypatch.setattr(module, "_ATTEMPTS", 0)
    assert refine(short).frames.relaxed[20:22].any()


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_very_short_clips(short, cut, frames):
    source = cut(short.source, 0, frames)
    after = refine(retarget(source, G1))
    assert after.qpos.shape == (frames, G1.nq) and np.isfinite(after.qpos).all()
    assert not after.frames.relaxed.any()


@pytest.mark.parametrize(
    "wrong", [{"acceleration_weight": 0.0}, {"tolerance": -1.0}, {"radii": ()}, {"radii": (0.1, 0)}]
)
def test_wrong_options_are_refused(wrong):
    with pytest.raises(InvalidOptionError, match=next(iter(wrong))):
        RefineOptions(**wrong)


def test_bars_on_a_recording(largebox):
    before = retarget(largebox, G1)
    check_bars(figures(before), figures(refine(before)))
