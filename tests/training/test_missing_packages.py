import importlib
import sys

import numpy as np
import pytest

from omni_envs.errors import MissingDependencyError
from omni_envs.training.curve import plot_curve
from omni_envs.training.onnx_policy import OnnxPolicy


def _import_without(monkeypatch, package: str, module: str) -> None:
    importlib.import_module(module)  # so that everything deleted below is put back
    for name in list(sys.modules):
        if name == package or name.startswith((f"{package}.", "omni_envs.training.")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    importlib.import_module(module)


@pytest.mark.parametrize("module", ["sb3_learner", "ppo", "policy", "sb3_vec_env"])
def test_training_names_the_extra(monkeypatch, module):
    with pytest.raises(MissingDependencyError, match=r"omni-envs\[sb3\]"):
        _import_without(monkeypatch, "stable_baselines3", f"omni_envs.training.{module}")


@pytest.mark.parametrize("module", ["env", "network", "ppo", "learner"])
def test_training_with_torchrl_names_the_extra(monkeypatch, module):
    with pytest.raises(MissingDependencyError, match=r"torchrl.*omni-envs\[torchrl\]"):
        _import_without(monkeypatch, "torchrl", f"omni_envs.training.torchrl_{module}")


@pytest.mark.parametrize("module", ["checkpoint", "network"])
def test_networks_name_the_extra(monkeypatch, module):
    with pytest.raises(MissingDependencyError, match=r"torch.*omni-envs\[sb3\]"):
        _import_without(monkeypatch, "torch", f"omni_envs.training.{module}")


def test_config_evaluation_and_recipes_need_no_extra(monkeypatch):
    for module in ("config", "evaluate", "recipes", "rollout"):
        _import_without(monkeypatch, "torch", f"omni_envs.training.{module}")


def test_policy_files_and_curves_name_the_extra(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingDependencyError, match=r"onnxruntime.*omni-envs\[export\]"):
        OnnxPolicy(tmp_path / "policy.onnx")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    row = {"steps": 1.0, "seconds": 1.0, "episode_length": np.nan}
    with pytest.raises(MissingDependencyError, match=r"matplotlib.*omni-envs\[viewer\]"):
        plot_curve(tmp_path, [row], 0.02)
