import os
import signal
import subprocess
import sys
import time

import pytest

torch = pytest.importorskip("torch")

from omni_envs.errors import FileFormatError  # noqa: E402
from omni_envs.training.checkpoint import Checkpoint, checkpoints, keep_newest  # noqa: E402


def _checkpoint(steps: int = 1200) -> Checkpoint:
    net = torch.nn.Linear(3, 2)
    optimizer = torch.optim.Adam(net.parameters(), fused=True)
    net(torch.ones(1, 3)).sum().backward()
    optimizer.step()
    return Checkpoint(
        steps=steps,
        seconds=3.5,
        updates=20,
        learning_rate=2e-3,
        policy=net.state_dict(),
        optimizer=optimizer.state_dict(),
        rng=torch.get_rng_state(),
        history=[{"steps": 600.0, "episode_length": 17.0}],
    )


def test_round_trip(tmp_path):
    saved = _checkpoint()
    loaded = Checkpoint.load(saved.save(tmp_path))
    assert loaded.steps == 1200 and loaded.history == saved.history
    assert torch.equal(loaded.policy["weight"], saved.policy["weight"])
    assert torch.equal(loaded.rng, saved.rng)
    assert torch.equal(loaded.optimizer["state"][0]["exp_avg"], torch.full((2, 3), 0.1))


def test_listed_oldest_first_and_partial_files_do_not_count(tmp_path):
    for steps in (5, 1200, 300):
        _checkpoint(steps).save(tmp_path)
    (tmp_path / "checkpoints" / ".step_000000000999.pt.77.tmp").write_bytes(b"half")
    (tmp_path / "checkpoints" / "step_best.pt").write_bytes(b"not ours")
    assert [Checkpoint.load(p).steps for p in checkpoints(tmp_path)] == [5, 300, 1200]
    assert checkpoints(tmp_path / "nowhere") == []


def test_the_first_and_the_newest_are_kept(tmp_path):
    for steps in range(0, 60, 10):
        _checkpoint(steps).save(tmp_path)
        keep_newest(tmp_path, 2)
    assert [Checkpoint.load(p).steps for p in checkpoints(tmp_path)] == [0, 40, 50]


@pytest.mark.parametrize("keep", [0, 10, 500, -100])
def test_a_cut_file_is_one_clear_error(tmp_path, keep):
    path = _checkpoint().save(tmp_path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(FileFormatError, match=r"step_0+1200\.pt: content: expected a whole"):
        Checkpoint.load(path)


def test_a_pickle_is_not_executed(tmp_path):
    path = tmp_path / "step_1.pt"
    torch.save({"format": 1, "steps": _Evil(tmp_path / "touched")}, path)
    with pytest.raises(FileFormatError):
        Checkpoint.load(path)
    assert not (tmp_path / "touched").exists()


class _Evil:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize("data", [[1, 2], {"format": 99}, {"format": 1, "steps": 3}])
def test_other_content_is_refused(tmp_path, data):
    path = tmp_path / "step_1.pt"
    torch.save(data, path)
    with pytest.raises(FileFormatError):
        Checkpoint.load(path)
    with pytest.raises(FileFormatError, match="nothing"):
        Checkpoint.load(tmp_path / "step_2.pt")


WRITER = """
import sys, torch
from pathlib import Path
from omni_envs.training.checkpoint import Checkpoint
net = torch.nn.Linear(500, 500)
for steps in range(10**6):
    Checkpoint(steps, 0.0, 0, 0.0, net.state_dict(), {}, torch.get_rng_state()).save(
        Path(sys.argv[1])
    )
    print(steps, flush=True)
"""


def test_a_killed_writer_leaves_only_whole_checkpoints(tmp_path):
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    for _ in range(5):
        writer.stdout.readline()
    time.sleep(0.005)
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    found = checkpoints(tmp_path)
    assert len(found) >= 5
    for path in found:
        Checkpoint.load(path)
