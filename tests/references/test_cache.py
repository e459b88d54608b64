import multiprocessing
import os
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.errors import OmniEnvsError
from omni_envs.references import cache, cache_folder, cached_reference
from omni_envs.references.key import reference_key
from omni_envs.references.npz import read_npz, write_npz
from omni_envs.retargeting import RetargetOptions
from omni_envs.robots import G1


def short_demonstration():
    whole = builtin_demonstration("box_carry")
    return replace(
        whole,
        positions=whole.positions[:6],
        object_poses=whole.object_poses[:6],
        orientations=None if whole.orientations is None else whole.orientations[:6],
        contacts={link: flags[:6] for link, flags in whole.contacts.items()},
    )


def count_makes(log: Path, then=lambda: None):
    """Replaces ``make_reference`` in the cache by one that notes every call."""
    make = cache.make_reference

    def counted(*args, **kwargs):
        with log.open("a") as file:
            file.write("made\n")
        then()
        return make(*args, **kwargs)

    return counted


@pytest.fixture
def demonstration():
    return short_demonstration()


@pytest.fixture
def log(tmp_path, monkeypatch):
    monkeypatch.setenv("OMNI_ENVS_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "log"
    path.touch()
    monkeypatch.setattr(cache, "make_reference", count_makes(path))
    return path


def makes(log):
    return len(log.read_text().split())


def entry():
    (path,) = (cache_folder() / "references").glob("*.npz")
    return path


def test_a_reference_is_made_once(demonstration, log):
    first = cached_reference(demonstration, "g1")
    second = cached_reference(demonstration, G1)
    assert makes(log) == 1
    np.testing.assert_array_equal(second.qpos, first.qpos)
    assert second.provenance == first.provenance
    assert second.report.summary() == first.report.summary()


def test_other_settings_are_other_entries(demonstration, log):
    cached_reference(demonstration, "g1")
    slow = cached_reference(demonstration, "g1", fps=25.0)
    loose = cached_reference(demonstration, "g1", options=RetargetOptions(surface_points=50))
    assert makes(log) == 3
    assert slow.fps == 25.0
    assert loose.provenance["options"]["surface_points"] == 50


def test_a_damaged_entry_is_made_again(demonstration, log):
    first = cached_reference(demonstration, "g1")
    data = entry().read_bytes()
    entry().write_bytes(data[: len(data) // 2])
    with pytest.warns(UserWarning, match="Damaged cache entry"):
        again = cached_reference(demonstration, "g1")
    assert makes(log) == 2
    np.testing.assert_allclose(again.qpos, first.qpos, atol=1e-9)
    cached_reference(demonstration, "g1")
    assert makes(log) == 2


def test_an_altered_entry_is_never_used(demonstration, log):
    first = cached_reference(demonstration, "g1")
    path = entry()
    arrays = read_npz(path)
    arrays["qpos"] = arrays["qpos"] + 0.0
    arrays["provenance"] = np.array('{"key": "of another"}')
    write_npz(path, arrays)
    again = cached_reference(demonstration, "g1")
    assert makes(log) == 2
    assert again.provenance["key"] == first.provenance["key"]


def test_a_folder_that_cannot_be_written_is_one_clear_error(demonstration, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("OMNI_ENVS_CACHE", str(tmp_path / "file"))
    with pytest.raises(OmniEnvsError, match="OMNI_ENVS_CACHE"):
        cached_reference(demonstration, "g1")


def test_the_folder_is_the_users_unless_named(monkeypatch, tmp_path):
    monkeypatch.delenv("OMNI_ENVS_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder().name == "omni_envs"
    monkeypatch.setenv("OMNI_ENVS_CACHE", "~/somewhere")
    assert cache_folder() == Path.home() / "somewhere"


def _make_in_process(folder, log, ready, go, sleep, results):
    os.environ["OMNI_ENVS_CACHE"] = str(folder)
    cache.make_reference = count_makes(log, lambda: time.sleep(sleep))
    demonstration = short_demonstration()
    ready.release()
    go.wait()
    reference = cached_reference(demonstration, "g1")
    results.put(float(reference.qpos.sum()))


def _start(count, folder, log, sleep):
    context = multiprocessing.get_context("spawn")
    ready, go, results = context.Semaphore(0), context.Event(), context.Queue()
    workers = [
        context.Process(target=_make_in_process, args=(folder, log, ready, go, sleep, results))
        for _ in range(count)
    ]
    for worker in workers:
        worker.start()
    for _ in workers:
        assert ready.acquire(timeout=120)
    go.set()
    return workers, results


def test_processes_that_ask_at_once_make_one(log):
    workers, results = _start(2, cache_folder(), log, 0.5)
    sums = {results.get(timeout=120) for _ in workers}
    for worker in workers:
        worker.join()
    assert makes(log) == 1
    assert len(sums) == 1
    assert entry().exists()


def test_a_killed_writer_leaves_nothing_harmful(demonstration, log):
    ((worker,), _) = _start(1, cache_folder(), log, 600.0)
    while not makes(log):
        time.sleep(0.02)
    os.kill(worker.pid, signal.SIGKILL)
    worker.join()
    assert not list((cache_folder() / "references").glob("*.npz"))
    key = reference_key(demonstration, G1, 50.0, RetargetOptions())
    name = f"{demonstration.name}-g1-{key[:24]}.npz"
    leftover = cache_folder() / "references" / f".{name}.1.2.tmp"
    leftover.write_bytes(b"half a file")
    cached_reference(demonstration, "g1")
    assert makes(log) == 2
    assert entry().name == name
    assert not leftover.exists()
