"""A short made-up motion of the G1 and an untrained policy for it."""

from __future__ import annotations

import numpy as np
import pytest

from omni_envs.references import Reference, reference_from_qpos
from omni_envs.robots import G1

FRAMES = 12


@pytest.fixture(scope="session")
def motion() -> Reference:
    """Standing, knees and wrists swinging."""
    qpos = np.tile(G1.default_qpos, (FRAMES, 1))
    wave = np.sin(np.linspace(0.0, 1.0, FRAMES))
    for i, name in enumerate(G1.joint_names):
        if "knee" in name or "wrist" in name:
            qpos[:, 7 + i] += 0.8 * wave
    return reference_from_qpos(G1, 50.0, qpos, provenance={"made by": "a test"})
