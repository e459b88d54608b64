import os
import subprocess
import sys

import pytest
import scipy.linalg  # noqa: F401 (loads the libraries that are looked at)
from threadpoolctl import threadpool_info, threadpool_limits

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.references import build
from omni_envs.threads import one_maths_thread, one_maths_thread_here

SHOW = "import os; print(os.environ.get('OMP_NUM_THREADS'), os.environ.get('MKL_NUM_THREADS'))"


def test_processes_started_within_use_one_thread_and_nothing_stays(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with one_maths_thread():
        shown = subprocess.run([sys.executable, "-c", SHOW], capture_output=True, text=True)
    assert shown.stdout.split() == ["1", "1"]
    assert os.environ["OMP_NUM_THREADS"] == "7" and "MKL_NUM_THREADS" not in os.environ


def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_linear_algebra_here_uses_one_thread_and_then_as_many_as_before():
    with threadpool_limits(3, user_api="blas"):
        before = threads()
        assert before == {3}
        with one_maths_thread_here():
            assert threads() == {1}
        assert threads() == before


def test_references_are_made_with_one_thread(monkeypatch):
    """Refinement of a G1 clip took 50 times as long with two threads on a busy machine."""
    seen = []

    def look(source, *_, **__):
        seen.append(threads())
        raise KeyboardInterrupt

    monkeypatch.setattr(build, "retarget", look)
    demonstration = builtin_demonstration("box_carry")
    with threadpool_limits(3, user_api="blas"):
        with pytest.raises(KeyboardInterrupt):
            build.make_reference(demonstration, "g1")
        assert threads() == {3}
    assert seen == [{1}]
