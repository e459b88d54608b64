"""How deep the robot is inside object, terrain, ground and itself."""

from __future__ import annotations

import numpy as np

from omni_envs.metrics.playback import SELF, TARGETS, Playback
from omni_envs.scenes import GROUND, OBJECT, TERRAIN, Scene


def penetration(playback: Playback, scene: Scene) -> dict[str, np.ndarray]:
    """Returns the depth d_t = max over pairs of geoms of max(0, -φ), for every target of the scene.

    Args:
        playback: The motion.
        scene: Its surroundings; targets that it lacks have no entry.

    Returns:
        ``"object"``, ``"terrain"``, ``"ground"``, ``"self"`` to (T,) depth, m.
    """
    present = {OBJECT: scene.object is not None, TERRAIN: scene.terrain is not None, GROUND: True}
    depths = {
        name: _deepest(playback, playback.target == i)
        for i, name in enumerate(TARGETS)
        if present[name]
    }
    depths[SELF] = _deepest(playback, playback.target < 0)
    return depths


def _deepest(playback: Playback, pairs: np.ndarray) -> np.ndarray:
    depth = np.zeros(playback.num_frames)
    np.maximum.at(depth, playback.frame[pairs], -playback.distance[pairs])
    return depth
