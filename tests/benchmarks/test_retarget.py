import ast
import importlib.util
import os
import sys

import numpy as np
import pytest

from omni_envs.benchmarks import retarget as bench
from omni_envs.demonstrations import SMPLH, Demonstration
from omni_envs.errors import InvalidOptionError, OmniEnvsError, UnknownNameError
from omni_envs.retargeting import interaction_mesh
from omni_envs.robots import KEYPOINTS

FRAMES = 5
DESIGN_KEYS = {"frames_per_s_cold", "frames_per_s_cached", "gmr_frames_per_s", "peak_memory_mb"}

# Half of a standing person, x forward, m.
STANDING = {
    "pelvis": (0, 0, 0.95),
    "hip": (0, 0.1, 0.88),
    "knee": (0.02, 0.1, 0.48),
    "ankle": (0, 0.1, 0.08),
    "toe": (0.13, 0.1, 0.02),
    "shoulder": (0, 0.18, 1.4),
    "elbow": (-0.02, 0.22, 1.12),
    "hand": (0.1, 0.22, 0.9),
}


@pytest.fixture
def demonstration() -> Demonstration:
    """Somebody who stands and sways."""
    positions = np.zeros((FRAMES, SMPLH.num_joints, 3))
    for keypoint in KEYPOINTS:
        side, _, part = keypoint.partition("_")
        point = np.array(STANDING[part or keypoint]) * (1, -1 if side == "right" else 1, 1)
        joint = SMPLH.joint_names.index(SMPLH.keypoint_joints[keypoint])
        sway = 0.02 * point[2] * np.sin(np.arange(FRAMES))
        positions[:, joint] = point + np.stack([sway, 0 * sway, 0 * sway], axis=-1)
    return Demonstration("sway", 30.0, SMPLH.joint_names, positions, SMPLH.keypoint_joints, 1.7)


def test_figures_of_a_process_of_its_own(demonstration, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    rows = bench.bench_retarget(demonstration, repeats=1)
    assert set(rows) >= DESIGN_KEYS
    assert (rows["frames"], rows["repeats"]) == (FRAMES, 1)
    assert all(np.isfinite(v) and v > 0 for v in rows.values())
    # One repeat: the median ratio is the ratio of the medians.
    ratio = rows["cpu_frames_per_s_cached"] / rows["cpu_gmr_frames_per_s"]
    assert rows["ratio_to_gmr"] == pytest.approx(ratio)
    ratio = rows["cpu_frames_per_s_cold"] / rows["cpu_gmr_frames_per_s"]
    assert rows["ratio_to_gmr_cold"] == pytest.approx(ratio)
    assert rows["ms_per_frame"] == pytest.approx(1e3 / rows["cpu_frames_per_s_cold"])
    stages = [v for k, v in rows.items() if k.startswith("ms_") and k != "ms_per_frame"]
    assert sum(stages) == pytest.approx(rows["ms_per_frame"])
    assert os.environ["OMP_NUM_THREADS"] == "7" and "MKL_NUM_THREADS" not in os.environ


def test_cold_makes_the_mesh_and_cached_does_not(demonstration, monkeypatch):
    log = []
    connect, gmr, run = interaction_mesh.connect, bench.gmr_retarget, bench.retarget

    def logged(name, call):
        return lambda *arguments: (log.append(name), call(*arguments))[1]

    monkeypatch.setattr(interaction_mesh, "connect", logged("mesh", connect))
    monkeypatch.setattr(bench, "gmr_retarget", logged("gmr", gmr))
    monkeypatch.setattr(bench, "retarget", logged("ours", run))
    bench.measure(demonstration, "g1", repeats=2)
    repeat = ["ours", "mesh", "gmr", "ours"]
    warm_up = ["ours", "mesh", "ours", "gmr"]
    assert log[: len(warm_up) + 2 * len(repeat)] == [*warm_up, *repeat, *repeat]


def test_robot_without_a_gmr_table(demonstration, monkeypatch):
    monkeypatch.setattr(bench, "GMR_MATCHES", {})
    rows = bench.measure(demonstration, "g1", repeats=1)
    assert {k for k, v in rows.items() if v is None} == {
        "gmr_frames_per_s",
        "cpu_gmr_frames_per_s",
        "gmr_iterations_per_frame",
        "ratio_to_gmr",
        "ratio_to_gmr_cold",
    }
    assert rows["frames_per_s_cold"] > 0


def test_wrong_wishes(demonstration, tmp_path):
    with pytest.raises(InvalidOptionError, match="repeats must be at least 1; got 0"):
        bench.bench_retarget(demonstration, repeats=0)
    with pytest.raises(UnknownNameError, match="nobody"):
        bench.bench_retarget(demonstration, robot="nobody")
    with pytest.raises(OmniEnvsError, match=r"clip\.pt"):
        bench.bench_retarget(tmp_path / "clip.pt")


def test_stages_name_what_exists():
    names = set()
    for module in bench.STAGES:
        spec = importlib.util.find_spec(f"omni_envs.retargeting.{module}")
        assert spec is not None and spec.origin, module
        with open(spec.origin) as file:
            tree = ast.parse(file.read())
        names |= {n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
    assert set(bench.WHOLE_STAGES) <= names


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_peak_memory_is_that_of_the_new_process(demonstration):
    block = np.ones(300_000_000 // 8)  # 300 MB here must not count there
    assert bench.bench_retarget(demonstration, repeats=1)["peak_memory_mb"] < 300 * block[0]
