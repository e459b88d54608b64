import numpy as np
import pytest

from omni_envs.benchmarks.step import bench_single, bench_step
from omni_envs.errors import UnknownNameError
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1


@pytest.fixture(scope="module")
def reference():
    return reference_from_qpos(G1, 50.0, np.tile(G1.default_qpos, (200, 1)))


@pytest.mark.parametrize("mode", ["default", "residual"])
def test_figures_of_stepping(reference, mode):
    figures = bench_step(
        num_envs=8,
        num_threads=1,
        seconds=0.2,
        reference=reference,
        action={"mode": mode},
        observation={"privileged": True},
    )
    assert figures["num_envs"] == 8
    assert figures["num_threads"] == 1
    assert figures["measurements"] >= 3
    # The environment does what raw physics does and more.
    assert 0.02 < figures["ratio"] < 1.1
    assert figures["steps_per_s"] > 50
    assert figures["raw_steps_per_s"] > 50


def test_figures_of_the_single_environment(reference):
    figures = bench_single(seconds=0.2, reference=reference)
    assert 0.01 < figures["ratio"] < 1.1


def test_only_environments_of_the_package():
    with pytest.raises(UnknownNameError, match="Valid: OmniEnvs/G1BoxCarry-v0"):
        bench_step("CartPole-v1")
