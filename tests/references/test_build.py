from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import Variation, builtin_demonstration
from omni_envs.errors import InvalidDataError, UnknownNameError
from omni_envs.references import Reference, build, evaluate_reference, make_reference
from omni_envs.references.key import reference_key
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import G1


@pytest.fixture(scope="module")
def demonstration():
    whole = builtin_demonstration("box_carry")
    part = slice(60, 90)
    return replace(
        whole,
        positions=whole.positions[part],
        object_poses=whole.object_poses[part],
        orientations=None if whole.orientations is None else whole.orientations[part],
        contacts={link: flags[part] for link, flags in whole.contacts.items()},
    )


@pytest.fixture(scope="module")
def whole():
    return make_reference(builtin_demonstration("box_carry"), "g1", fps=30.0)


@pytest.fixture(scope="module")
def reference(demonstration):
    return make_reference(demonstration, "g1")


def test_the_reference_follows_the_demonstration_at_its_rate(demonstration, reference):
    assert (reference.robot, reference.fps) == ("g1", 50.0)
    assert reference.num_frames == 49  # 29/30 s
    assert reference.source.num_frames == 49
    assert reference.source.scale == pytest.approx(G1.height / demonstration.height)
    np.testing.assert_allclose(reference.object_poses, reference.source.object_poses, atol=1e-9)
    np.testing.assert_array_equal(reference.stance, reference.source.stance["default"])
    assert reference.contacts.keys() == reference.source.contacts.keys()


def test_the_report_proves_the_constraints(reference):
    summary = reference.report.summary()
    assert summary["penetration_max_m"] < 1e-3
    assert summary["self_penetration_max_m"] < 1e-3
    assert summary["joint_violation_max_rad"] < 1e-9
    assert summary["velocity_violation_max_rad_s"] < 1e-6
    assert summary["relaxed_frames"] == 0
    assert summary["energy_mean"] < 0.1


def test_provenance_says_how_to_make_it_again(demonstration, reference):
    provenance = reference.provenance
    assert provenance["demonstration"] == demonstration.name
    assert provenance["licence"] == demonstration.licence
    assert provenance["options"]["laplacian_weight"] == 10.0
    assert provenance["versions"].keys() == {"omni_envs", "mujoco", "format"}
    assert provenance["hashes"].keys() >= {"demonstration", "scene", "robot", "settings"}
    assert provenance["key"] == reference_key(demonstration, G1, 50.0, RetargetOptions())
    assert provenance["solved_frames"] == reference.num_frames
    assert provenance["solve_seconds"] > 0


def test_the_file_holds_report_and_source(reference, tmp_path):
    back = Reference.load(reference.save(tmp_path / "r.npz"))
    assert back.report.summary() == reference.report.summary()
    assert back.provenance == reference.provenance
    np.testing.assert_array_equal(back.source.keypoints, reference.source.keypoints)
    assert back.source.stance.keys() == reference.source.stance.keys()
    for link, points in reference.source.contact_points.items():
        np.testing.assert_array_equal(back.source.contact_points[link], points)


def test_evaluating_anew_gives_the_same_report(reference):
    anew = evaluate_reference(reference).summary()
    for name, value in reference.report.summary().items():
        assert anew[name] == (value if value is None else pytest.approx(value, abs=1e-9)), name


def test_a_tampered_motion_does_not_keep_its_report(reference):
    qpos = reference.qpos.copy()
    qpos[:, 2] -= 0.05
    assert evaluate_reference(replace(reference, qpos=qpos)).summary()["penetration_max_m"] > 0.04


def test_options_and_progress_reach_the_retargeter(demonstration):
    calls = []
    reference = make_reference(
        demonstration,
        G1,
        fps=10.0,
        options=RetargetOptions(laplacian_weight=5.0),
        progress=lambda done, total: calls.append((done, total)),
    )
    assert reference.fps == 10.0
    assert reference.provenance["options"]["laplacian_weight"] == 5.0
    assert calls[-1][0] == calls[-1][1]
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_bad_arguments_are_refused(demonstration):
    with pytest.raises(UnknownNameError, match="r2d2"):
        make_reference(demonstration, "r2d2")
    with pytest.raises(InvalidDataError, match="fps"):
        make_reference(demonstration, "g1", fps=0.0)


def test_variation_starts_where_asked_and_holds_the_constraints(whole):
    demonstration = builtin_demonstration("box_carry")
    variation = Variation(object_translation=(0.0, 0.2), object_yaw=np.pi / 4)
    nominal = whole
    varied = make_reference(demonstration, "g1", fps=30.0, variation=variation, nominal=nominal)
    start = varied.object_poses[0, :3] - nominal.object_poses[0, :3]
    assert np.linalg.norm(start) == pytest.approx(0.2) and start[2] == 0
    end = varied.object_poses[-1, :3] - nominal.object_poses[-1, :3]
    assert np.linalg.norm(end) < 0.02
    summary = varied.report.summary()
    assert summary["penetration_max_m"] < 1e-3 and summary["contact_clean_fraction"] > 0.98
    assert summary["slip_fraction_text"] <= 0.01 and summary["joint_violation_max_rad"] == 0
    # The robot goes to the box: base and legs alone stay near the nominal motion at the start.
    assert np.abs(varied.qpos[0, :7] - nominal.qpos[0, :7]).max() < 0.1
    assert varied.provenance["variation"]["object_yaw"] == pytest.approx(np.pi / 4)
    assert varied.provenance["key"] != nominal.provenance["key"]


def test_a_variation_inside_of_the_robot_is_refused(whole):
    pose = whole.object_poses[0]
    reach = float(np.linalg.norm(pose[:2] - whole.qpos[0, :2]))
    with pytest.raises(InvalidDataError, match="outside of the robot at the start"):
        make_reference(
            builtin_demonstration("box_carry"),
            "g1",
            fps=30.0,
            variation=Variation(object_translation=(-reach, 0.0), object_scale=(1.0, 1.0, 3.0)),
            nominal=whole,
        )


def test_a_variation_that_leaves_no_place_to_start_is_refused(
    demonstration, reference, monkeypatch
):
    """As where terrain grew over someone who leans on it: solved as well as could be, but deep."""
    lowered = reference.qpos.copy()
    lowered[:, 2] -= 0.05
    deep = evaluate_reference(replace(reference, qpos=lowered))
    monkeypatch.setattr(build, "evaluate", lambda *_, **__: deep)
    turned = Variation(object_yaw=0.1)
    with pytest.raises(InvalidDataError, match=r"turn.*can start outside .*; got 5\.\d cm in it"):
        make_reference(demonstration, "g1", variation=turned, nominal=reference)
    # A nominal reference is what the demonstration asks for: its report tells.
    assert make_reference(demonstration, "g1").report is deep


def test_jumps_of_the_recording_are_told(demonstration):
    positions = demonstration.positions.copy()
    positions[15] += [1.0, 0.0, 0.0]
    broken = replace(demonstration, positions=positions)
    with pytest.warns(UserWarning, match=r"box_carry.* jumps to frame 15, 16 \(pelvis, "):
        made = make_reference(broken, "g1", fps=30.0)
    assert made.report.summary()["velocity_violation_max_rad_s"] == 0


def test_what_the_robot_does_not_reach_is_a_warning(demonstration):
    poses = demonstration.object_poses + np.eye(7)[0] * 2.0  # 2 m ahead
    touching = {"left_hand": np.ones(demonstration.num_frames, bool)}
    far = replace(demonstration, object_poses=poses, contacts=touching)
    told = r"Unitree G1 does not reach .*box_carry.*: left hand by \d+ cm \(frames 0 to \d+\)"
    with pytest.warns(UserWarning, match=told):
        make_reference(far, "g1", fps=30.0)
