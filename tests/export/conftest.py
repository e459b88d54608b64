"""A short made-up motion of the G1, untrained policies for it, and their files."""

from __future__ import annotations

import numpy as np
import pytest

from omni_envs.references import Reference, reference_from_qpos
from omni_envs.robots import G1

FRAMES = 12
TORSO = {"anchor": "torso", "observation": {"state_estimation": False}}
"""Options of policies that every stack can feed."""


@pytest.fixture(scope="session")
def motion() -> Reference:
    """Standing, knees and wrists swinging."""
    qpos = np.tile(G1.default_qpos, (FRAMES, 1))
    wave = np.sin(np.linspace(0.0, 1.0, FRAMES))
    for i, name in enumerate(G1.joint_names):
        if "knee" in name or "wrist" in name:
            qpos[:, 7 + i] += 0.8 * wave
    return reference_from_qpos(G1, 50.0, qpos, provenance={"made by": "a test"})


@pytest.fixture
def described(motion):
    """Makes descriptions of policies, by default for the G1 and its motion, anchored at the torso.

    Options of the task replace these.
    """
    from omni_envs.export.description import PolicyDescription
    from omni_envs.tracking import make_config
    from omni_envs.tracking.feedforward import action_targets
    from omni_envs.tracking.observations import policy_layout

    def describe(mode="default", motion=motion, robot=G1, scale=1.0, **options):
        config = make_config(action={"mode": mode, "scale": scale}, **{**TORSO, **options})
        targets = None if mode == "default" else action_targets(robot, [motion], mode)[0]
        layout = policy_layout(config.observation, robot.num_joints)
        return PolicyDescription(robot, motion, layout, config, targets)

    return describe


@pytest.fixture
def actor():
    """Makes untrained networks with a normaliser that does something."""
    import torch

    from omni_envs.training.normalizer import RunningNormalizer

    def make(size: int, outputs: int = 29) -> torch.nn.Module:
        torch.manual_seed(0)
        normalizer = RunningNormalizer(size)
        normalizer.update(torch.randn(100, size) * 3 + 1)
        layers = (torch.nn.Linear(size, 32), torch.nn.ELU(), torch.nn.Linear(32, outputs))
        return torch.nn.Sequential(normalizer, *layers)

    return make


@pytest.fixture
def export(actor, tmp_path):
    """Writes the files of a profile; returns the graph, the policy file and all paths."""
    from omni_envs.export.profiles import WRITERS
    from omni_envs.training.onnx_policy import OnnxPolicy

    def write(profile, description, folder=tmp_path):
        network = actor(description.layout.size, description.robot.num_joints)
        graph = WRITERS[profile].graph(network, description)
        files = WRITERS[profile].write(graph, description, folder / "policy.onnx", "runs/x")
        return graph, OnnxPolicy(files[0]), files

    return write


@pytest.fixture
def observed(motion):
    """Makes observations of the environment for frames, made up but for the command."""
    rng = np.random.default_rng(0)

    def make(frames, description) -> np.ndarray:
        seen = rng.normal(size=(len(frames), description.layout.size)).astype(np.float32)
        both = np.concatenate([motion.joint_positions, motion.joint_velocities], axis=1)
        seen[:, description.layout.slices["command"]] = both[frames]
        return seen

    return make
