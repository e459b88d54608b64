import os
import subprocess
import sys

from omni_envs.threads import one_maths_thread

SHOW = "import os; print(os.environ.get('OMP_NUM_THREADS'), os.environ.get('MKL_NUM_THREADS'))"


def test_processes_started_within_use_one_thread_and_nothing_stays(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with one_maths_thread():
        shown = subprocess.run([sys.executable, "-c", SHOW], capture_output=True, text=True)
    assert shown.stdout.split() == ["1", "1"]
    assert os.environ["OMP_NUM_THREADS"] == "7" and "MKL_NUM_THREADS" not in os.environ
