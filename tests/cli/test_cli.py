import json
import os
import subprocess
import sys

import numpy as np
import pytest

from omni_envs.cli import main
from omni_envs.references import Reference

KEYS = {
    "frames", "fps", "penetration_max_m", "penetration_fraction_1mm", "slip_fraction_text",
    "slip_fraction_default", "slip_max_code_m_s", "stance_drift_max_m",
    "stance_still_drift_max_m", "stance_pivot_drift_max_m", "stance_clearance_max_m",
    "self_penetration_max_m",
    "joint_violation_max_rad", "velocity_violation_max_rad_s", "contact_fraction_2cm",
    "contact_clean_fraction", "contact_point_gap_mean_m", "energy_mean", "energy_max",
    "joint_acceleration_rms", "relaxed_frames",
}  # fmt: skip


@pytest.fixture(scope="module")
def retargeted(tmp_path_factory):
    """The built-in demonstration, retargeted by the command: its file."""
    path = tmp_path_factory.mktemp("cli") / "box_carry.npz"
    assert main(["retarget", "box_carry", "--robot", "g1", "--out", str(path), "--json"]) == 0
    return path


def output(capsys) -> dict:
    return json.loads(capsys.readouterr().out)


def test_list_names_what_there_is(capsys):
    assert main(["list", "--json"]) == 0
    listed = output(capsys)
    assert "OmniEnvs/G1BoxCarry-v0" in listed["environments"]
    assert "g1" in listed["robots"] and "box_carry" in listed["demonstrations"]


def test_retarget_prints_the_figures_of_the_file(tmp_path, capsys):
    path = tmp_path / "new" / "r.npz"
    assert main(["retarget", "box_carry", "--fps", "30", "--out", str(path), "--json"]) == 0
    rows = output(capsys)
    assert rows.keys() == KEYS | {"solve_seconds", "frames_per_s"}
    reference = Reference.load(path)
    assert rows["frames"] == len(reference.qpos) and rows["fps"] == reference.fps == 30
    assert rows["frames_per_s"] > 0


def test_several_sources_go_into_a_folder(tmp_path, capsys):
    sources = []
    for name in ("a", "b"):
        positions = np.zeros((3, 53, 3), np.float32)
        positions[:, :, 2] = np.linspace(0.0, 1.7, 53)
        np.save(tmp_path / f"{name}.npy", positions[:, :, :2])  # not positions: refused
        sources.append(str(tmp_path / f"{name}.npy"))
    assert main(["retarget", *sources, "--out", str(tmp_path / "out"), "--json"]) == 1
    assert "a.npy" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_evaluate_reads_what_retarget_wrote(retargeted, capsys):
    assert main(["evaluate", str(retargeted), "--json"]) == 0
    rows = output(capsys)
    assert rows.keys() == KEYS
    assert rows["penetration_max_m"] < 2e-3 and rows["contact_fraction_2cm"] > 0.98


def test_evaluate_compares_several_files(retargeted, capsys):
    assert main(["evaluate", str(retargeted), str(retargeted), "--json"]) == 0
    first, second = output(capsys)
    assert first == second


def test_evaluate_holds_files_against_the_bars(retargeted, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert main(["evaluate", str(retargeted), str(retargeted)]) == 0
    table = capsys.readouterr().out
    assert "contact-point gap" in table and "✓" in table
    assert main(["evaluate", str(retargeted), "--details"]) == 0
    assert "joint_jerk_rms" in capsys.readouterr().out


def test_evaluate_takes_a_peers_motion(retargeted, tmp_path, capsys):
    reference = Reference.load(retargeted)
    path = tmp_path / "peer.npz"
    qpos = np.concatenate([reference.qpos, reference.object_poses], axis=1)
    np.savez(path, qpos=qpos, fps=np.array(reference.fps))
    assert main(["evaluate", str(path), "--source", "box_carry", "--json"]) == 0
    peer = output(capsys)
    assert main(["evaluate", str(retargeted), "--json"]) == 0
    ours = output(capsys)
    for key in ("penetration_max_m", "contact_fraction_2cm", "energy_mean"):
        assert peer[key] == pytest.approx(ours[key], rel=1e-6, abs=1e-9)


def test_view_writes_pictures(retargeted, tmp_path, capsys):
    pytest.importorskip("imageio")
    strip, video = tmp_path / "s.png", tmp_path / "v.gif"
    status = main(["view", str(retargeted), "--strip", str(strip), "--json"])
    if status == 1 and "rendering" in capsys.readouterr().err:
        pytest.skip("no offscreen rendering here")
    assert status == 0 and strip.stat().st_size > 10_000
    assert not video.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["retarget", "no_such_clip", "--out", "r.npz"], "box_carry"),
        (["retarget", "box_carry", "--robot", "r2d2", "--out", "r.npz"], "g1"),
        (["retarget", "box_carry", "--out", "r.csv"], ".npz"),
        (["retarget", "box_carry", "box_carry", "--out", "folder"], "overwrite"),
        (["retarget", "absent.pt", "--out", "r.npz"], "absent.pt"),
        (["evaluate", "absent.npz"], "absent.npz"),
        (["view", "absent.npz"], "absent.npz"),
        (["export", "absent_run"], "absent_run"),
    ],
)
def test_what_cannot_be_done_says_why_in_one_line(
    arguments, message, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and message in lines[0]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [[], ["no_command"], ["retarget"], ["list", "--no-such"]])
def test_wrong_usage_exits_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2


@pytest.mark.parametrize("words", [["list"], ["retarget", "--help"]])
def test_a_reader_that_has_read_enough_is_no_error(words):
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "omni_envs.cli", *words]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert done.stderr == ""
