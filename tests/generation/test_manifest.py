import pytest

from omni_envs.demonstrations import Variation
from omni_envs.generation import Item, Manifest
from omni_envs.generation.item import file_hash

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


def test_shards_write_apart_and_read_together(tmp_path, row):
    for number in (1, 2):
        Manifest(tmp_path, (number, 2)).add(row | {"name": str(number)})
    assert len(list(tmp_path.glob("manifest-*.jsonl"))) == 2
    assert set(Manifest(tmp_path).rows) == {"1", "2"}
