import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from omni_envs.demonstrations import builtin_demonstration
from omni_envs.errors import InvalidOptionError, OmniEnvsError
from omni_envs.references import make_reference, make_references, parallel
from omni_envs.retargeting import RetargetOptions

FAST = RetargetOptions(refine=False)


def clip(name, start, stop):
    whole = builtin_demonstration("box_carry")
    cut = slice(start, stop)
    return replace(
        whole,
        name=name,
        positions=whole.positions[cut],
        orientations=None if whole.orientations is None else whole.orientations[cut],
        object_poses=whole.object_poses[cut],
        contacts={k: v[cut] for k, v in whole.contacts.items()},
    )


def test_processes_make_what_one_process_makes():
    clips = [clip("short", 0, 10), clip("long", 120, 150)]
    seen = []
    made = make_references(
        clips, "g1", fps=30, options=FAST, jobs=2, progress=lambda *p: seen.append(p)
    )
    for demonstration, reference in zip(clips, made, strict=True):
        alone = make_reference(demonstration, "g1", fps=30, options=FAST)
        assert reference.provenance["demonstration"] == demonstration.name
        np.testing.assert_allclose(reference.qpos, alone.qpos, atol=1e-9)
    assert seen[-1] == (40, 40)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_one_that_cannot_be_used_does_not_stop_the_others():
    good, bad = clip("good", 0, 5), clip("bad", 0, 5)
    # Broken after its own validation, as an array edited in place can be.
    bad = replace(bad, positions=bad.positions.copy())
    bad.positions[2] = np.nan
    made = make_references([bad, good], "g1", fps=30, options=FAST, jobs=1)
    assert isinstance(made[0], OmniEnvsError) and "finite" in str(made[0])
    assert made[1].provenance["demonstration"] == "good"


def test_no_demonstration_is_no_reference():
    assert make_references([], "g1") == []


@pytest.mark.parametrize("jobs", [0, -1])
def test_jobs_are_checked(jobs):
    with pytest.raises(InvalidOptionError, match="jobs"):
        make_references([], "g1", jobs=jobs)


def test_workers_come_from_a_server_that_has_imported_what_they_need():
    context = parallel.worker_context()
    if "forkserver" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork server on this system")
    assert context.get_start_method() == "forkserver"
    with ProcessPoolExecutor(1, context) as pool:
        first = pool.submit(_imported, "omni_envs.references.parallel").result()
        assert first and pool.submit(_imported, "numba").result()


def _imported(module):
    return module in sys.modules
