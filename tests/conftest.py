"""Imported before any test module, so that MuJoCo finds the graphics library that works here."""

import omni_envs  # noqa: F401, I001

import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.references import reference_from_qpos
from omni_envs.robots import G1
from omni_envs.scenes import Box, ConvexMesh, Part, Scene, SceneObject

FPS = 50.0


def _sway(
    frames: int = 120, with_object: bool = True, mesh: bool = False, half: float | None = None
):
    """A standing G1 that sways and turns on the spot, a box sliding in front of it."""
    t = np.arange(frames) / FPS
    qpos = np.tile(G1.default_qpos, (frames, 1))
    qpos[:, 0] += 0.05 * np.sin(2 * t)
    qpos[:, 3:7] = rotations.exp(np.stack([0 * t, 0.05 * np.sin(3 * t), 0.4 * t], axis=1))
    phase = np.arange(G1.num_joints)
    qpos[:, 7:] += 0.1 * np.sin(3.0 * t[:, None] + phase) - 0.1 * np.sin(phase)
    if not with_object:
        return reference_from_qpos(G1, FPS, qpos)
    poses = np.zeros((frames, 7))
    poses[:, :3] = np.stack([1.0 + 0.1 * np.sin(t), 0.1 * t, 0.16 + 0.0 * t], axis=1)
    poses[:, 3:] = rotations.exp(np.stack([0 * t, 0 * t, 0.3 * t], axis=1))
    shape = Box((0.2, 0.18, 0.15) if half is None else (half, half, half))
    if mesh:
        surface = shape.mesh()
        shape = ConvexMesh(np.array(surface.vertices), np.array(surface.faces))
    scene = Scene(object=SceneObject("box", (Part(shape),), mass=1.0))
    return reference_from_qpos(G1, FPS, qpos, poses, scene)


@pytest.fixture(scope="session")
def sway():
    return _sway
