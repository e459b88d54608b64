import os
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.demonstrations import (
    SMPLH,
    Demonstration,
    load_demonstration,
    scale_demonstration,
)
from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.metrics import evaluate
from omni_envs.retargeting.comparators import GMR_MATCHES, gmr_retarget
from omni_envs.retargeting.human_frames import HUMAN_BODIES
from omni_envs.robots import G1

SHARED = Path(os.environ.get("OMNI_ENVS_SHARED", Path(__file__).parents[3] / "shared"))
BOX = SHARED / "data" / "omomo" / "sub3_largebox_003.pt"
needs_box = pytest.mark.skipif(not BOX.is_file(), reason=f"no {BOX}")

JOINTS = {
    body: f"{body[0].upper()}_{part.capitalize()}" if part else ""
    for body in HUMAN_BODIES
    for _, _, part in [body.partition("_")]
} | {"pelvis": "Pelvis", "torso": "Chest", "left_foot": "L_Toe", "right_foot": "R_Toe"}


def squats(frames: int = 12) -> np.ndarray:
    """(T, nq) a robot that squats, turns and reaches, its toes always on the ground."""
    qpos = np.tile(G1.default_qpos, (frames, 1))
    for t, phase in enumerate(np.linspace(0, np.pi, frames)):
        depth = 0.4 * np.sin(phase)
        for joint, value in {
            "hip_pitch": -0.3 - depth,
            "knee": 0.6 + 2 * depth,
            "ankle_pitch": -0.3 - depth,
            "shoulder_pitch": -depth,
            "elbow": 0.6 - depth,
        }.items():
            for side in ("left", "right"):
                qpos[t, 7 + G1.joint_names.index(f"{side}_{joint}_joint")] = value
        qpos[t, 7 + G1.joint_names.index("waist_yaw_joint")] = depth
        qpos[t, 3:7] = rotations.exp(np.array([0, 0, 0.5 * phase]))
        qpos[t, 0] = 0.3 * np.sin(phase)
    return qpos


def as_human(qpos: np.ndarray, height: float = G1.height) -> Demonstration:
    """The human whose targets the robot meets exactly, in InterMimic's layout."""
    model = G1.model
    data = mujoco.MjData(model)
    frames = len(qpos)
    positions = np.zeros((frames, SMPLH.num_joints, 3))
    orientations = np.tile([1.0, 0, 0, 0], (frames, SMPLH.num_joints, 1))
    for t, q in enumerate(qpos):
        data.qpos = q
        mujoco.mj_kinematics(model, data)
        for human, match in GMR_MATCHES["g1"].items():
            i = SMPLH.joint_names.index(JOINTS[human])
            body = data.body(match.body)
            target = body.xpos + rotations.rotate(body.xquat, np.array(match.point))
            positions[t, i] = target - rotations.rotate(body.xquat, np.array(match.offset))
            frame = rotations.multiply(body.xquat, rotations.conjugate(match.rotation))
            orientations[t, i] = rotations.multiply(frame, rotations.conjugate(np.full(4, 0.5)))
    toes = [SMPLH.joint_names.index(f"{side}_Toe") for side in "LR"]
    positions[..., 2] -= positions[:, toes, 2].min()
    return Demonstration(
        "squats", 30.0, SMPLH.joint_names, positions, SMPLH.keypoint_joints, height,
        orientations=orientations,
    )  # fmt: skip


def test_recovers_the_motion_that_made_the_targets():
    qpos = squats()
    motion = gmr_retarget(as_human(qpos), G1)
    assert (motion.robot, motion.fps, motion.num_frames) == ("g1", 30.0, len(qpos))
    assert motion.object_poses is None
    np.testing.assert_allclose(motion.qpos[:, 7:], qpos[:, 7:], atol=0.05)
    np.testing.assert_allclose(motion.qpos[:, :2], qpos[:, :2], atol=0.01)
    np.testing.assert_allclose(
        rotations.difference(motion.qpos[:, 3:7], qpos[:, 3:7]), 0, atol=0.02
    )


def test_scale_ratio_shrinks_everything_about_the_origin():
    human = as_human(squats())
    motion = gmr_retarget(human, G1)
    taller = replace(human, positions=1.4 * human.positions, height=1.4 * G1.height)
    np.testing.assert_allclose(gmr_retarget(taller, G1).qpos, motion.qpos, atol=1e-6)


def test_scale_table_moves_the_root_by_its_own_scale():
    human = as_human(squats(), height=1.8)
    human = replace(human, positions=human.positions / 0.9)
    motion = gmr_retarget(human, G1, scale="table")
    path = 0.9 * human.positions[:, SMPLH.joint_names.index("Pelvis"), :2]
    np.testing.assert_allclose(motion.qpos[:, :2], path, atol=0.03)
    # A taller human gives larger targets: the table multiplies by height / 1.8.
    taller = gmr_retarget(replace(human, height=1.98), G1, scale="table")
    reach, longer = (np.ptp(m.qpos[:, 0]) for m in (motion, taller))
    assert longer == pytest.approx(1.1 * reach, rel=0.05)


def test_joint_limits_hold_when_targets_ask_for_more():
    human = as_human(squats())
    orientations = human.orientations.copy()
    for joint in ("L_Elbow", "R_Knee", "Chest"):
        i = SMPLH.joint_names.index(joint)
        turn = rotations.exp(np.array([0.0, 2.5, 0.0]))
        orientations[:, i] = rotations.multiply(turn, orientations[:, i])
    joints = gmr_retarget(replace(human, orientations=orientations), G1).qpos[:, 7:]
    low, high = G1.joint_ranges.T
    assert (joints >= low - 1e-6).all() and (joints <= high + 1e-6).all()
    assert (np.minimum(joints - low, high - joints).min(axis=1) < 0.02).all(), (
        "no limit was reached"
    )


def test_counts_and_times_every_frame():
    calls = []
    motion = gmr_retarget(as_human(squats(4)), G1, progress=lambda *a: calls.append(a))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert ((motion.iterations >= 2) & (motion.iterations <= 22)).all()
    assert motion.seconds.shape == (4,) and (motion.seconds > 0).all()


def test_refuses_what_it_does_not_know():
    human = as_human(squats(2))
    with pytest.raises(UnknownNameError, match=r"GMR comparator 'nobody'.*g1"):
        gmr_retarget(human, replace(G1, name="nobody"))
    with pytest.raises(InvalidOptionError, match="ratio or table; got 'human'"):
        gmr_retarget(human, G1, scale="human")  # type: ignore[arg-type]


@needs_box
@pytest.mark.parametrize(
    ("scale", "peak_speed", "slip", "deep", "clean"),
    [("ratio", 6.2, 0.59, 1.0, 0.0), ("table", 5.0, 0.78, 0.57, 0.45)],
)
def test_behaves_as_the_original_on_a_box_clip(scale, peak_speed, slip, deep, clean):
    # Figures of the original on the same clip, measured against the shells of the robot.
    demonstration = load_demonstration(BOX)
    motion = gmr_retarget(demonstration, G1, scale=scale)
    speed = np.abs(np.diff(motion.qpos[:, 7:], axis=0)).max() * motion.fps
    assert speed == pytest.approx(peak_speed, abs=0.3)
    source = scale_demonstration(demonstration, G1.height)
    report = evaluate(G1, source.scene, motion.fps, motion.qpos, motion.object_poses, source)
    figures = report.summary()
    assert figures["slip_fraction_default"] == pytest.approx(slip, abs=0.08)
    assert figures["penetration_max_m"] > 0.05
    depth = report.surroundings_penetration
    assert np.mean(depth > 0.01) == pytest.approx(deep, abs=0.2)
    assert figures["contact_clean_fraction"] == pytest.approx(clean, abs=0.2)


@needs_box
def test_estimated_frames_serve_a_source_without_orientations():
    demonstration = load_demonstration(BOX)
    known = gmr_retarget(demonstration, G1).qpos
    estimated = gmr_retarget(replace(demonstration, orientations=None), G1).qpos
    np.testing.assert_allclose(estimated[:, :3], known[:, :3], atol=0.08)
    heading = rotations.difference(estimated[:, 3:7], known[:, 3:7])
    assert np.degrees(np.linalg.norm(heading, axis=1)).max() < 30
