import numpy as np
import pytest

from omni_envs.benchmarks.soak import bench_soak
from omni_envs.envs import OmniVectorEnv
from omni_envs.errors import InvalidOptionError, UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1


@pytest.fixture(scope="module")
def reference():
    return reference_from_qpos(G1, 50.0, np.tile(G1.default_qpos, (200, 1)))


def test_nothing_breaks(reference, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # MuJoCo may log warnings into the working directory
    figures = bench_soak(steps=3000, num_envs=20, num_threads=1, reference=reference)
    assert figures["physics_steps"] == 4 * figures["control_steps"] >= 3000
    assert figures["not_finite"] == 0
    assert figures["episodes"] > figures["diverged"] >= figures["diverged_bad_action"] > 0
    assert figures["resident_mb_start"] > 0 and figures["resident_mb_end"] > 0


def test_what_is_not_finite_is_counted(reference, monkeypatch):
    real = OmniVectorEnv.step

    def step(self, actions):
        observations, reward, *rest = real(self, actions)
        observations[3, :2], reward[1] = np.nan, np.inf
        return observations, reward, *rest

    monkeypatch.setattr(OmniVectorEnv, "step", step)
    figures = bench_soak(steps=1, num_envs=5, num_threads=1, reference=reference)
    assert figures["not_finite"] == 3


def test_bad_options():
    with pytest.raises(InvalidOptionError, match="steps"):
        bench_soak(steps=0)
    with pytest.raises(UnknownNameError, match="Valid: OmniEnvs/G1BoxCarry-v0"):
        bench_soak("CartPole-v1")
