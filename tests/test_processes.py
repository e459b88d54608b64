import os
import signal
import subprocess
import sys
import time

import pytest

PARENT = """
import multiprocessing, os, sys, time
from concurrent.futures import ProcessPoolExecutor
from omni_envs.processes import end_with_parent

if __name__ == "__main__":
    end_with_parent()  # nothing to end with
    context = multiprocessing.get_context(sys.argv[1])
    with ProcessPoolExecutor(1, context, end_with_parent) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(time.sleep, 600)
        time.sleep(600)
"""


def gone(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="looks processes up in /proc")
@pytest.mark.parametrize("method", ["spawn", "forkserver"])
def test_workers_end_when_their_parent_is_killed(tmp_path, method):
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    parent = subprocess.Popen(
        [sys.executable, str(script), method], stdout=subprocess.PIPE, text=True
    )
    worker = int(parent.stdout.readline())
    assert worker != parent.pid and not gone(worker)
    time.sleep(0.5)
    assert not gone(worker)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    end = time.monotonic() + 30
    while not gone(worker):
        assert time.monotonic() < end, "the worker outlives its parent"
        time.sleep(0.05)
