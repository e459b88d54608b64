import subprocess
import sys

import pytest

from omni_envs.demonstrations import Variation
from omni_envs.errors import OmniEnvsError
from omni_envs.generation import Item, Manifest
from omni_envs.generation.item import file_hash
from omni_envs.generation.manifest import sole_writer

ITEM = Item("a/g1/nominal", "a", "{}", "g1", Variation(), 50.0, True, 10, "key")


@pytest.fixture
def row(tmp_path):
    path = tmp_path / ITEM.file
    path.parent.mkdir(parents=True)
    path.write_bytes(b"reference")
    return {"name": ITEM.name, "status": "done", "key": "key", "sha256": file_hash(path)}


def test_rows_survive(tmp_path, row):
    Manifest(tmp_path).add(row)
    manifest = Manifest(tmp_path)
    assert manifest.rows == {ITEM.name: row} and manifest.is_done(ITEM)


@pytest.mark.parametrize("change", [{"key": "old"}, {"status": "failed"}, {"sha256": "0"}])
def test_stale_failed_and_damaged_are_not_done(tmp_path, row, change):
    manifest = Manifest(tmp_path)
    manifest.add(row | change)
    assert not manifest.is_done(ITEM)
    manifest.add(row)
    assert Manifest(tmp_path).is_done(ITEM)  # the later row counts


def test_missing_file_is_not_done(tmp_path, row):
    Manifest(tmp_path).add(row)
    (tmp_path / ITEM.file).unlink()
    assert not Manifest(tmp_path).is_done(ITEM)


def test_torn_last_line_is_skipped_and_ended(tmp_path, row):
    manifest = Manifest(tmp_path)
    manifest.add(row)
    whole = manifest.path.read_text()
    manifest.path.write_text(whole + whole[:20])
    again = Manifest(tmp_path)
    assert again.is_done(ITEM)
    again.add(row | {"name": "b"})
    assert set(Manifest(tmp_path).rows) == {ITEM.name, "b"}


def test_tidying_keeps_the_newest_rows_and_other_shards(tmp_path, row):
    one, two = (Manifest(tmp_path, (number, 2)) for number in (1, 2))
    one.tidy()  # nothing there yet
    assert not one.path.exists()
    for key in ("old", "key"):
        for name in (ITEM.name, "b"):
            one.add(row | {"name": name, "key": key})
    one.path.write_text(one.path.read_text() + "{torn")
    two.add(row | {"name": "c"})
    before, theirs = Manifest(tmp_path).rows, two.path.read_bytes()
    one.tidy()
    assert one.path.read_text().count("\n") == 2 and '"old"' not in one.path.read_text()
    assert Manifest(tmp_path).rows == before and two.path.read_bytes() == theirs
    whole = one.path.stat().st_mtime_ns
    one.tidy()
    assert one.path.stat().st_mtime_ns == whole
    assert sorted(p.name for p in tmp_path.glob("manifest*")) == [one.path.name, two.path.name]


def test_shards_write_apart_and_read_together(tmp_path, row):
    for number in (1, 2):
        Manifest(tmp_path, (number, 2)).add(row | {"name": str(number)})
    assert len(list(tmp_path.glob("manifest-*.jsonl"))) == 2
    assert set(Manifest(tmp_path).rows) == {"1", "2"}


def test_one_writer_per_part(tmp_path):
    with sole_writer(tmp_path / "new", (1, 1)):
        with (
            pytest.raises(OmniEnvsError, match=r"Another process.*--shard 1/2"),
            sole_writer(tmp_path / "new", (1, 1)),
        ):
            pass
        with sole_writer(tmp_path / "new", (2, 3)):  # another part
            pass
    with sole_writer(tmp_path / "new", (1, 1)):  # the first one is done
        pass
    assert not list((tmp_path / "new").iterdir())


def test_the_lock_of_a_killed_writer_does_not_stay(tmp_path):
    code = (
        "import sys, time\nfrom pathlib import Path\n"
        "from omni_envs.generation.manifest import sole_writer\n"
        "with sole_writer(Path(sys.argv[1]), (1, 1)):\n    print(flush=True); time.sleep(60)"
    )
    writer = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE)
    assert writer.stdout is not None and writer.stdout.readline()
    with pytest.raises(OmniEnvsError, match="Another process"), sole_writer(tmp_path, (1, 1)):
        pass
    writer.kill()
    writer.wait()
    with sole_writer(tmp_path, (1, 1)):
        pass
