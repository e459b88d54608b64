import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from omni_envs.cli import main
from omni_envs.demonstrations import Variation
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.generation import Manifest, Recipe, SourceEntry, generate, make_item
from omni_envs.generation.generate import plan
from omni_envs.references import Reference

MOVED = Variation(object_translation=(0.1, 0.0))
ENTRY = SourceEntry("box_carry", ("g1",), variations=(Variation(), MOVED))
# Slow and unrefined: what is tested is the making of many, not their quality.
RECIPE = Recipe((ENTRY,), fps=10.0, refine=False)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    out = tmp_path_factory.mktemp("dataset")
    seen = []
    figures = generate(RECIPE, out, jobs=2, previews=1, progress=lambda *a: seen.append(a))
    return out, figures, seen


def test_every_item_is_made_once(dataset):
    out, figures, seen = dataset
    assert figures == {
        "items": 2, "made": 2, "kept": 0, "failed": 0, "frames": 312, "failed_names": [],
    }  # fmt: skip
    assert seen[-1] == (312, 312)
    rows = Manifest(out).rows
    for variation in ENTRY.variations:
        name = f"box_carry/g1/{variation.name}"
        reference = Reference.load(out / f"{name}.npz")
        assert reference.num_frames == 156 == rows[name]["frames"]
        assert rows[name]["key"] == reference.provenance["key"]
        assert rows[name]["summary"]["relaxed_frames"] == 0 and rows[name]["cpu_seconds"] > 0
    assert {p.suffix for p in out.rglob("*.*")} <= {".npz", ".jsonl", ".md", ".png"}


def test_a_second_run_keeps_everything(dataset):
    out, _, _ = dataset
    before = {p: p.stat().st_mtime_ns for p in out.rglob("*.npz")}
    figures = generate(RECIPE, out, jobs=1)
    assert (figures["made"], figures["kept"]) == (0, 2)
    assert before == {p: p.stat().st_mtime_ns for p in out.rglob("*.npz")}


def test_a_damaged_file_is_made_again(dataset):
    out, _, _ = dataset
    path = out / "box_carry/g1/nominal.npz"
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert generate(RECIPE, out, jobs=1)["made"] == 1
    Reference.load(path)


def test_card_tells_what_is_there(dataset):
    out, _, _ = dataset
    card = (out / "README.md").read_text()
    assert "2 references" in card and "box_carry/g1/nominal.npz" in card
    assert "Licence" in card and "frames/s" in card
    if "histograms.png" in card:
        assert (out / "histograms.png").stat().st_size > 5000


def test_processes_and_their_function_make_the_same(dataset, tmp_path):
    out, _, _ = dataset
    item = next(i for i in plan(RECIPE)[0] if i.variation == MOVED)
    row = make_item(item, str(tmp_path))
    assert row["status"] == "done"
    there, here = (Reference.load(folder / item.file) for folder in (out, tmp_path))
    np.testing.assert_array_equal(there.qpos, here.qpos)


def test_shards_share_the_items(tmp_path):
    names = []
    for number in (1, 2):
        figures = generate(RECIPE, tmp_path, jobs=1, shard=(number, 2), previews=0)
        assert figures["items"] == figures["made"] == 1
        names.append({p.name for p in tmp_path.rglob("*.npz")})
    assert len(names[1]) == 2 and len(Manifest(tmp_path).rows) == 2
    assert generate(RECIPE, tmp_path, jobs=1)["kept"] == 2


def test_broken_sources_do_not_stop_the_others(tmp_path):
    (tmp_path / "broken.bvh").write_text("HIERARCHY")
    impossible = Variation(terrain_height=2.0)
    sources = (
        SourceEntry(str(tmp_path / "broken.bvh"), ("g1",)),
        SourceEntry("box_carry", ("g1",), variations=(Variation(), impossible)),
    )
    out = tmp_path / "out"
    figures = generate(Recipe(sources, 10.0, False), out, jobs=1, previews=0)
    assert (figures["items"], figures["failed"]) == (3, 2)
    rows = Manifest(out).rows
    assert "broken.bvh" in rows[str(tmp_path / "broken.bvh")]["message"]
    assert "no terrain" in rows["box_carry/g1/height_2.00"]["message"]
    assert "Not made" in (out / "README.md").read_text()
    # What is no longer asked for, and a file that somebody took away, leave the card.
    sound = SourceEntry("box_carry", ("g1",))
    (out / "box_carry/g1/nominal.npz").rename(out / "elsewhere.npz")
    named = Recipe((replace(sound, name="a carry"),), 10.0, False)
    assert generate(named, out, jobs=1, previews=1)["failed"] == 0
    card = (out / "README.md").read_text()
    assert "Not made" not in card and "1 references" in card and "a carry/g1/nominal" in card
    provenance = Reference.load(out / "a carry/g1/nominal.npz").provenance
    assert provenance["demonstration"] == "a carry"


def test_killed_and_resumed_without_loss_or_repetition(tmp_path):
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text(
        "robots: [g1]\nfps: 10\nrefine: false\nsources:\n- demonstration: box_carry\n"
        "  grid: {object_yaw: [0.05, 0.1, 0.15, 0.2, 0.25, 0.3]}\n"
    )
    out = tmp_path / "out"
    words = ["generate", str(recipe), "--out", str(out), "--jobs", "1", "--previews", "0"]
    process = subprocess.Popen(
        [sys.executable, "-m", "omni_envs.cli", *words],
        cwd=Path(__file__).parents[2],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    end = time.monotonic() + 120
    manifest = out / "manifest.jsonl"
    while not (manifest.is_file() and manifest.read_text().count("\n") >= 2):
        assert time.monotonic() < end and process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)  # to the command alone: its workers end with it
    process.wait()
    done = {row["file"] for row in Manifest(out).rows.values()}
    assert 2 <= len(done) < 7
    times = {file: (out / file).stat().st_mtime_ns for file in done}
    assert main(words) == 0
    assert all((out / file).stat().st_mtime_ns == at for file, at in times.items())
    rows = [json.loads(line) for line in manifest.read_text().splitlines()]
    assert len(rows) == 7 == len({row["name"] for row in rows})
    assert not list(out.rglob("*.tmp"))


def test_bad_options_are_refused(tmp_path, capsys):
    with pytest.raises(InvalidOptionError, match="local, ray"):
        generate(RECIPE, tmp_path, engine="slurm")
    with pytest.raises(InvalidOptionError, match="jobs"):
        generate(RECIPE, tmp_path, jobs=0)
    with pytest.raises(InvalidOptionError, match="shard"):
        generate(RECIPE, tmp_path, shard=(3, 2))
    with pytest.raises(OmniEnvsError, match="'box_carry/g1/nominal' twice, from box_carry\\."):
        generate(Recipe((ENTRY, ENTRY)), tmp_path)
    assert main(["generate", "none.yaml", "--out", str(tmp_path), "--shard", "half"]) == 1
    assert "i/n" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_ray_makes_the_same(dataset, tmp_path):
    pytest.importorskip("ray", reason="the ray extra is not installed")
    out, _, _ = dataset
    assert generate(RECIPE, tmp_path, jobs=2, engine="ray", previews=0)["made"] == 2
    for variation in ENTRY.variations:
        file = f"box_carry/g1/{variation.name}.npz"
        there, here = Reference.load(out / file), Reference.load(tmp_path / file)
        np.testing.assert_array_equal(there.qpos, here.qpos)
