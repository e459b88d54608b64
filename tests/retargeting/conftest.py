"""Sources that the tests of retargeting share: short, made on the spot, quick to solve."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import (
    builtin_demonstration,
    load_demonstration,
    scale_demonstration,
)
from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.retargeting.clip_qp import Band, ClipQP
from omni_envs.retargeting.kinematics import Kinematics
from omni_envs.robots import G1, SIDES


def cut_source(source: SourceMotion, start: int, stop: int) -> SourceMotion:
    """Frames [start, stop) of a source."""
    part = slice(start, stop)

    def some(array):
        return None if array is None else np.asarray(array)[part]

    return replace(
        source,
        keypoints=source.keypoints[part],
        object_poses=some(source.object_poses),
        source_object_poses=some(source.source_object_poses),
        stance={mode: flags[part] for mode, flags in source.stance.items()},
        contacts={link: flags[part] for link, flags in source.contacts.items()},
        contact_points={link: points[part] for link, points in source.contact_points.items()},
    )


@pytest.fixture(scope="session")
def box_carry() -> SourceMotion:
    """The built-in box carry at the scale of the G1."""
    return scale_demonstration(builtin_demonstration("box_carry"), G1.height)


@pytest.fixture(scope="session")
def grasp(box_carry) -> SourceMotion:
    """60 frames of it: from before the first touch of the box into the carry."""
    first = int(np.flatnonzero(box_carry.contacts["left_hand"])[0])
    return cut_source(box_carry, max(first - 20, 0), first + 40)


@pytest.fixture(scope="session")
def cut():
    """``cut(source, start, stop)``: frames of a source."""
    return cut_source


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of recordings to measure on; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("OMNI_ENVS_SHARED", Path(__file__).parents[3] / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("recordings to measure on are not here (set OMNI_ENVS_SHARED)")
    return folder


@pytest.fixture(scope="session")
def largebox(shared) -> SourceMotion:
    """The OMOMO clip that the official retargeter is compared on, at the scale of the G1."""
    folder = shared / "data" / "omomo"
    clip = load_demonstration(folder / "sub3_largebox_003.pt", object_mesh=folder / "largebox.obj")
    return scale_demonstration(clip, G1.height)


@pytest.fixture(scope="session")
def official_g1():
    """The G1 with the joint ranges and posture weights that OmniRetarget gives it."""
    wrists = {"wrist_roll": (-0.1, 0.2), "wrist_pitch": (-0.1, 0.3), "wrist_yaw": (-0.05, 0.05)}
    ranges = {f"{s}_{j}_joint": limits for s in SIDES for j, limits in wrists.items()}
    return replace(
        G1,
        reference_ranges={**G1.reference_ranges, **ranges},
        posture_weights={"waist_yaw_joint": 0.2, "waist_roll_joint": 0.2},
    )


@pytest.fixture(scope="session")
def make_clip_qp():
    """``make_clip_qp(frames, n, rows, pairs, seed)``: a random program of a clip."""
    return _make_clip_qp


@pytest.fixture(scope="session")
def dense_clip_qp():
    """``dense_clip_qp(qp)``: Hessian and constraint matrix, written out from the definition."""
    return _dense_clip_qp


def _make_clip_qp(frames=7, n=5, rows=4, pairs=2, seed=0) -> ClipQP:
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(frames, 3, n))
    H = np.swapaxes(J, 1, 2) @ J + 0.1 * np.eye(n)
    weight = rng.uniform(1.0, 3.0, n)
    diagonal = np.zeros((frames, n))
    D, E = np.zeros((max(frames - 1, 0), n)), np.zeros((max(frames - 2, 0), n))
    for t in range(frames - 2):
        diagonal[t : t + 3] += weight * np.array([[1.0], [4.0], [1.0]])
        D[t : t + 2] -= 2.0 * weight
        E[t] += weight
    H[:, np.arange(n), np.arange(n)] += diagonal
    inside = rng.uniform(0.02, 0.1, (frames, n))
    change = rng.uniform(0.02, 0.1, (max(frames - 1, 0), n))
    low = rng.normal(size=(frames, rows)) * 0.05 - 0.1
    half = rng.uniform(0.01, 0.05, (max(frames - 1, 0), pairs))
    B, C = rng.normal(size=(2, max(frames - 1, 0), pairs, n))
    return ClipQP(
        H=H,
        g=2.0 * rng.normal(size=(frames, n)),
        D=D,
        E=E,
        box=Band(-inside, inside),
        change=Band(-change, change),
        rows=Band(low, np.full_like(low, np.inf), np.full_like(low, 1e6)),
        A=rng.normal(size=(frames, rows, n)),
        pairs=Band(-half, half, 1e5),
        B=B,
        C=C,
    )


def _dense_clip_qp(qp: ClipQP) -> tuple[np.ndarray, np.ndarray]:
    """Hessian and constraint matrix, written out from the definition."""
    frames, n = qp.g.shape
    hessian = np.zeros((frames, n, frames, n))
    for t in range(frames):
        hessian[t, :, t] = qp.H[t]
        if t + 1 < frames:
            hessian[t + 1, :, t] = hessian[t, :, t + 1] = np.diag(qp.D[t])
        if t + 2 < frames:
            hessian[t + 2, :, t] = hessian[t, :, t + 2] = np.diag(qp.E[t])
    blocks = [np.eye(frames * n).reshape(-1, frames, n)]
    change = np.zeros((frames - 1, n, frames, n))
    pairs = np.zeros((*qp.B.shape[:2], frames, n))
    rows = np.zeros((*qp.A.shape[:2], frames, n))
    for t in range(frames - 1):
        change[t, :, t], change[t, :, t + 1] = -np.eye(n), np.eye(n)
        pairs[t, :, t], pairs[t, :, t + 1] = qp.B[t], qp.C[t]
    for t in range(frames):
        rows[t, :, t] = qp.A[t]
    blocks += [part.reshape(-1, frames, n) for part in (change, rows, pairs)]
    return hessian.reshape(frames * n, -1), np.concatenate(blocks).reshape(-1, frames * n)


@pytest.fixture(scope="module")
def configuration(grasp) -> Kinematics:
    """The G1 beside the box, on frame 50 of the grasp."""
    configuration = Kinematics(G1, grasp.scene)
    configuration.place_object(grasp.object_poses[50])
    return configuration


@pytest.fixture(scope="module")
def q(grasp) -> np.ndarray:
    """A pose near the box there."""
    q = G1.default_qpos.copy()
    q[:3] = grasp.keypoints[50, 0]
    q[7:] += np.random.default_rng(0).normal(scale=0.1, size=29)
    return q
