import numpy as np
import pytest

from omni_envs import rotations
from omni_envs.robots import G1
from omni_envs.scenes import Box, Part, Scene, SceneObject

FPS = 50.0


def _smooth_qpos(frames: int = 40, fps: float = FPS, yaw: float = 0.0) -> np.ndarray:
    """A turning, tumbling, smooth motion of the G1, the whole of it turned by ``yaw``."""
    t = np.arange(frames) / fps
    qpos = np.tile(G1.default_qpos, (frames, 1))
    qpos[:, :3] += np.stack([0.8 * t, 0.3 * np.sin(2 * t), 0.1 * np.cos(3 * t)], axis=1)
    turn = rotations.exp(np.stack([0.4 * np.sin(3 * t), 0.3 * t, 1.5 * t], axis=1))
    heading = np.broadcast_to(rotations.exp(np.array([0.0, 0.0, yaw])), (frames, 4))
    qpos[:, :3] = rotations.rotate(heading, qpos[:, :3])
    qpos[:, 3:7] = rotations.multiply(heading, turn)
    phase = np.arange(G1.num_joints)
    qpos[:, 7:] += 0.3 * np.sin(2.0 * t[:, None] + phase) - 0.3 * np.sin(phase)
    return qpos


def _smooth_object(frames: int = 40, fps: float = FPS) -> np.ndarray:
    t = np.arange(frames) / fps
    poses = np.zeros((frames, 7))
    poses[:, :3] = np.stack([1 + 0.2 * t, 0.1 * t**2, 0.5 + 0.1 * np.sin(t)], axis=1)
    poses[:, 3:] = rotations.exp(np.stack([t, 0.5 * t, 1.0 + 0 * t], axis=1))
    return poses


@pytest.fixture
def box_scene() -> Scene:
    return Scene(object=SceneObject("box", (Part(Box((0.2, 0.2, 0.2))),)))


@pytest.fixture
def smooth_qpos():
    return _smooth_qpos


@pytest.fixture
def smooth_object():
    return _smooth_object
