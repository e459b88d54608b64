import signal
import time
from types import FunctionType

import pytest

from omni_envs.benchmarks.stages import StageSampler

pytestmark = pytest.mark.skipif(not StageSampler.available(), reason="needs POSIX timers")


def function(module: str, name: str, source: str, **known: object) -> FunctionType:
    """A function that lives in a module of the given name."""
    space: dict = {"__name__": module, "signal": signal, **known}
    exec(f"def {name}():\n    {source}", space)
    return space[name]


LOOK = "[signal.raise_signal(signal.SIGALRM) for _ in range({})]"
MODULES = {"pkg.maths": "maths", "pkg.solver": "qp"}


def test_the_innermost_known_module_counts():
    helper = function("elsewhere", "helper", LOOK.format(300))
    maths = function("pkg.maths", "multiply", "helper()", helper=helper)
    solver = function("pkg.solver", "solve", f"{LOOK.format(100)}; maths()", maths=maths)
    sampler = StageSampler(MODULES, {})
    with sampler:
        solver()
    shares = sampler.shares()
    assert shares["maths"] == pytest.approx(0.75, abs=0.02)
    assert shares["qp"] == pytest.approx(0.25, abs=0.02)
    assert next(iter(shares)) == "maths"


def test_a_claiming_function_takes_its_callees():
    maths = function("pkg.maths", "multiply", LOOK.format(300))
    repair = function("pkg.solver", "_repair", "maths()", maths=maths)
    sampler = StageSampler(MODULES, {"_repair": "repair"})
    with sampler:
        repair()
    assert sampler.shares()["repair"] > 0.98
    # The same name elsewhere claims nothing.
    stranger = function("elsewhere", "_repair", "maths()", maths=maths)
    sampler = StageSampler(MODULES, {"_repair": "repair"})
    with sampler:
        stranger()
    assert sampler.shares()["maths"] > 0.98


def test_looks_by_itself_and_stops_after():
    sampler = StageSampler(MODULES, {})
    before = signal.getsignal(signal.SIGALRM)
    with sampler:
        deadline = time.monotonic() + 10
        while not sampler.shares() and time.monotonic() < deadline:
            pass
    assert sampler.shares() == {"other": 1.0}
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_no_sample_is_no_share():
    assert StageSampler(MODULES, {}).shares() == {}
