import os

import numpy as np
import pytest

from omni_envs.errors import InvalidOptionError
from omni_envs.retargeting import RetargetOptions, retarget
from omni_envs.retargeting.parallel import retarget_many
from omni_envs.robots import G1


def test_processes_give_the_same_motions_in_order(grasp, cut):
    sources = [cut(grasp, 0, 8), cut(grasp, 10, 22), cut(grasp, 5, 9)]
    options, calls = RetargetOptions(refine=False), []
    threads = os.environ.get("OMP_NUM_THREADS")
    motions = retarget_many(sources, G1, options, 2, lambda *call: calls.append(call))
    assert os.environ.get("OMP_NUM_THREADS") == threads
    assert calls[-1] == (24, 24) and len(calls) == 3
    for source, motion in zip(sources, motions, strict=True):
        np.testing.assert_allclose(motion.qpos, retarget(source, G1, options).qpos, atol=1e-9)


def test_one_job_needs_no_process(grasp, cut):
    (motion,) = retarget_many([cut(grasp, 0, 5)], G1, jobs=1)
    assert motion.num_frames == 5
    assert retarget_many([], G1) == []


def test_bad_jobs():
    with pytest.raises(InvalidOptionError, match="jobs"):
        retarget_many([], G1, jobs=0)
