import json

import numpy as np
import pytest

from omni_envs.errors import InvalidDataError
from omni_envs.metrics import ReferenceReport, evaluate, summary_table
from omni_envs.metrics.playback import play
from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, SceneObject

KEYS = [
    "frames",
    "fps",
    "penetration_max_m",
    "penetration_fraction_1mm",
    "slip_fraction_text",
    "slip_fraction_default",
    "slip_max_code_m_s",
    "stance_drift_max_m",
    "stance_still_drift_max_m",
    "stance_pivot_drift_max_m",
    "stance_clearance_max_m",
    "self_penetration_max_m",
    "joint_violation_max_rad",
    "velocity_violation_max_rad_s",
    "contact_fraction_2cm",
    "contact_clean_fraction",
    "contact_point_gap_mean_m",
    "energy_mean",
    "energy_max",
    "joint_acceleration_rms",
    "relaxed_frames",
]
NEED_SOURCE = [k for k in KEYS if k.startswith(("slip", "stance", "contact", "energy"))]


def source_of(qpos, make_source, **fields):
    return make_source(play(G1, Scene(), 50.0, qpos, None).keypoints(), **fields)


def test_a_motion_that_is_its_own_source_is_perfect(standing, make_source):
    qpos = standing(20)
    report = evaluate(G1, Scene(), 50.0, qpos, source=source_of(qpos, make_source))
    summary = report.summary()
    assert list(summary) == KEYS
    assert summary["frames"] == 20
    assert summary["energy_max"] == pytest.approx(0.0, abs=1e-7)
    assert report.keypoint_error.max() < 1e-12
    for name in ("slip_fraction_text", "slip_max_code_m_s", "stance_drift_max_m"):
        assert summary[name] == 0.0
    assert summary["penetration_max_m"] < 1e-6
    assert summary["contact_fraction_2cm"] is None  # nothing to touch
    assert summary["relaxed_frames"] is None  # nobody said


def test_without_a_source_what_needs_one_is_none(standing):
    summary = evaluate(G1, Scene(), 50.0, standing(5)).summary()
    assert list(summary) == KEYS
    assert all(summary[name] is None for name in NEED_SOURCE)
    assert summary["penetration_fraction_1mm"] == 0.0
    json.dumps(summary, allow_nan=False)


def test_every_fault_shows_up_in_its_own_figure(standing, make_source):
    good = standing(30)
    source = source_of(good, make_source)
    bad = good.copy()
    bad[10:, 0] += 0.004  # a step of 20 cm/s
    bad[20, 2] -= 0.02  # sinks
    wrist = 7 + G1.joint_names.index("right_wrist_yaw_joint")
    bad[25:, wrist] = G1.joint_ranges[wrist - 7, 1] + 0.1
    summary = evaluate(G1, Scene(), 50.0, bad, source=source, relaxed=np.arange(30) == 20).summary()
    assert summary["slip_max_code_m_s"] == pytest.approx(0.2, abs=1e-7)
    assert summary["slip_fraction_default"] == pytest.approx(1 / 29)
    assert summary["stance_drift_max_m"] == pytest.approx(0.004, abs=1e-7)
    assert summary["stance_still_drift_max_m"] == pytest.approx(0.004, abs=1e-7)
    assert summary["penetration_max_m"] == pytest.approx(0.02, abs=1e-6)
    assert summary["penetration_fraction_1mm"] == pytest.approx(1 / 30)
    assert summary["joint_violation_max_rad"] == pytest.approx(0.1)
    assert summary["velocity_violation_max_rad_s"] > 10
    assert summary["relaxed_frames"] == 1
    assert summary["energy_max"] > 0
    assert summary["joint_acceleration_rms"] > 0


def test_slip_off_stance_does_not_count(standing, make_source):
    qpos = standing(10)
    stance = np.ones((10, 2), bool)
    stance[4:6] = False
    source = source_of(qpos, make_source, stance={"default": stance, "text": stance & False})
    qpos[5:, 0] += 0.1
    summary = evaluate(G1, Scene(), 50.0, qpos, source=source).summary()
    assert summary["slip_fraction_default"] == 0.0
    assert summary["stance_drift_max_m"] == 0.0
    assert summary["slip_fraction_text"] is None  # no planted frame
    assert summary["slip_max_code_m_s"] is None  # no such set


def test_contact_and_clean_contact(standing, make_source):
    scene = Scene(object=SceneObject("floor", (Part(Box((1.0, 1.0, 0.1))),)))
    qpos = standing(40)
    qpos[:, 2] += np.repeat([0.0, 0.015, 0.03, -0.015], 10)  # touching, 1.5 cm off, 3 cm off, deep
    poses = np.tile([0.0, 0.0, -0.1, 1, 0, 0, 0], (40, 1))
    keypoints = play(G1, scene, 50.0, qpos, poses).keypoints()
    desired = np.ones(40, bool)
    source = make_source(
        keypoints,
        scene=scene,
        object_poses=poses,
        source_object_poses=poses,
        contacts={"left_foot": desired, "right_foot": desired, "left_hand": ~desired},
        contact_points={"left_foot": np.tile([0.05, 0.1, 0.1], (40, 1))},
    )
    report = evaluate(G1, scene, 50.0, qpos, poses, source)
    summary, details = report.summary(), report.details()
    assert summary["contact_fraction_2cm"] == pytest.approx(0.75)
    assert summary["contact_clean_fraction"] == pytest.approx(0.5)
    assert details["contact_fraction_1cm"] == pytest.approx(0.5)
    assert details["contact_fraction_5cm"] == 1.0
    assert details["contact_all_fraction_2cm"] == pytest.approx(0.75)
    assert details["contact_fraction_left_hand_2cm"] is None
    assert np.isfinite(summary["contact_point_gap_mean_m"])


def test_energy_follows_the_object(standing, make_source):
    scene = Scene(object=SceneObject("box", (Part(Box((0.2, 0.2, 0.2))),)))
    qpos = standing(3)
    poses = np.tile([0.5, 0.0, 0.9, 1, 0, 0, 0], (3, 1))
    keypoints = play(G1, scene, 50.0, qpos, poses).keypoints()
    source = make_source(keypoints, scene=scene, object_poses=poses, source_object_poses=poses)
    shift = np.array([0.1, 0.2, 0.0])
    moved, along = poses.copy(), qpos.copy()
    moved[:, :3] += shift
    along[:, :3] += shift
    still = evaluate(G1, scene, 50.0, qpos, moved, source).energy
    carried = evaluate(G1, scene, 50.0, along, moved, source).energy
    np.testing.assert_allclose(carried, 0.0, atol=1e-7)
    assert still.min() > 1e-3


def test_report_round_trip(standing, make_source):
    qpos = standing(8)
    report = evaluate(
        G1, Scene(), 50.0, qpos, source=source_of(qpos, make_source), relaxed=np.zeros(8, bool)
    )
    back = ReferenceReport.from_arrays(report.to_arrays())
    assert back.summary() == report.summary()
    assert back.details() == report.details()
    with pytest.raises(InvalidDataError, match="nonsense"):
        ReferenceReport.from_arrays({"nonsense": np.zeros(3)})
    with pytest.raises(InvalidDataError, match="slip"):
        ReferenceReport.from_arrays({**report.to_arrays(), "slip": np.zeros((3, 2))})


def test_tables_show_every_figure(standing):
    report = evaluate(G1, Scene(), 50.0, standing(5))
    assert report.table("a motion").row_count == len(report.summary()) + len(report.details())
    table = summary_table({"a": report.summary(), "b": report.summary()})
    assert [c.header for c in table.columns] == ["figure", "a", "b"]


@pytest.mark.parametrize(("change", "field"), [({"frames": 4}, "frames"), ({"fps": 30.0}, "fps")])
def test_a_source_of_other_frames_is_refused(standing, make_source, change, field):
    qpos = standing(5)
    source = make_source(np.zeros((change.get("frames", 5), 15, 3)), change.get("fps", 50.0))
    with pytest.raises(InvalidDataError, match=field):
        evaluate(G1, Scene(), 50.0, qpos, source=source)


def test_one_frame_is_a_motion(standing, make_source):
    qpos = standing(1)
    summary = evaluate(G1, Scene(), 50.0, qpos, source=source_of(qpos, make_source)).summary()
    assert summary["joint_acceleration_rms"] is None
    assert summary["slip_fraction_default"] is None
