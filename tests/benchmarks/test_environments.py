import json

import numpy as np
import pytest

from omni_envs.benchmarks.environments import bench_environments
from omni_envs.errors import UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1


def test_every_figure_is_there(tmp_path, monkeypatch):
    from omni_envs.benchmarks import environments

    monkeypatch.setattr(environments, "WORKERS", 2)
    monkeypatch.setattr(environments, "SLICE", 0.05)
    motion = reference_from_qpos(G1, 50.0, np.tile(G1.default_qpos, (200, 1)))
    file = str(motion.save(tmp_path / "stand.npz"))
    figures = bench_environments(
        num_envs=(4, 8), num_threads=(1,), seconds=0.1, reference=file, physics="fast"
    )
    assert [(v["num_envs"], v["num_threads"]) for v in figures["vector"]] == [(4, 1), (8, 1)]
    measured = [*figures["vector"], figures["single"], figures["humanoid"]]
    for m in measured:
        assert m["ratio"] > 0 and m["steps_per_s"] > 0 and m["raw_steps_per_s"] > 0
    assert figures["ratio"] == figures["vector"][-1]["ratio"]
    assert [a["workers"] for a in figures["asynchronous"]] == [2, 4]
    assert all(a["async_steps_per_s"] > 0 for a in figures["asynchronous"])
    assert figures["construct_seconds"] > 0 and figures["bytes_per_env"] > 0
    json.dumps(figures, allow_nan=False)


def test_only_environments_of_the_package():
    with pytest.raises(UnknownNameError, match="Valid: OmniEnvs/G1BoxCarry-v0"):
        bench_environments("CartPole-v1")
