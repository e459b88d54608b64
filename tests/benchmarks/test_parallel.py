import numpy as np
import pytest

from omni_envs.benchmarks import parallel as bench
from omni_envs.demonstrations import builtin_demonstration
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.retargeting import RetargetOptions

FAST = RetargetOptions(refine=False)


def beginning():
    return bench._beginning(builtin_demonstration("box_carry"))


def test_same_batch_in_one_process_and_in_two():
    rows = bench.bench_parallel([beginning()], items=3, options=FAST)
    assert (rows["items"], rows["jobs"]) == (3, 2) and rows["frames"] >= 6
    assert rows["ratio"] == pytest.approx(rows["seconds_1"] / rows["seconds_n"])
    assert rows["frames_per_s_n"] == pytest.approx(rows["frames"] / rows["seconds_n"])
    assert 0 < rows["busy_fraction"] < 1 and rows["startup_s"] > 0


def test_no_two_items_are_alike():
    clip = builtin_demonstration("box_carry")
    rates = [bench.at_pace(clip, number).fps for number in range(12)]
    assert len(set(np.round(rates, 6))) == 12 and min(rates) > 0.5 * clip.fps


def test_wrong_wishes(tmp_path):
    for wrong in ({"jobs": 0}, {"items": 0}, {"repeats": 0}):
        with pytest.raises(InvalidOptionError, match=next(iter(wrong))):
            bench.bench_parallel(**wrong)
    with pytest.raises(InvalidOptionError, match="at least one demonstration"):
        bench.bench_parallel([])
    with pytest.raises(OmniEnvsError, match=r"clip\.pt"):
        bench.bench_parallel([tmp_path / "clip.pt"])
