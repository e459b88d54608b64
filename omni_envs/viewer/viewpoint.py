"""Where to look at a motion from: the side on which terrain hides least of the robot."""

from __future__ import annotations

import mujoco
import numpy as np

from omni_envs.references import Reference
from omni_envs.robots import get_robot
from omni_envs.scenes import Scene, build_spec
from omni_envs.scenes.rendering import Camera, camera_pose

SIDES = (125.0, 55.0, 90.0, -125.0, -55.0, -90.0, 180.0, 0.0)
"""Azimuths from the robot's heading, degrees, the most telling first: its front right, rear right,
right, front left, …"""

SLOPES = (-11.0, -25.0)
"""Elevations, degrees."""

_FRAMES = 12  # that are looked at
_RELUCTANCE = 0.01  # share of the robot that may be hidden rather than take the next best side


def choose_camera(reference: Reference) -> Camera:
    """Returns a camera that follows the robot from where terrain hides least of it.

    Without terrain it is at the robot's front right, as it faces on the first frame.
    """
    w, x, y, z = reference.qpos[0, 3:7]
    heading = float(np.rad2deg(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))
    cameras = [Camera(heading + side, slope) for slope in SLOPES for side in SIDES]
    if reference.scene.terrain is None:
        return cameras[0]
    hidden = [_hidden_share(reference, camera) for camera in cameras]
    return cameras[int(np.argmin(np.array(hidden) + _RELUCTANCE * np.arange(len(cameras))))]


def _hidden_share(reference: Reference, camera: Camera) -> float:
    """Share of the robot's bodies, over the whole motion, that terrain hides from a camera."""
    model = build_spec(None, Scene(terrain=reference.scene.terrain)).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    robot, geom = get_robot(reference.robot), np.zeros(1, np.int32)
    frames = np.linspace(0, reference.num_frames - 1, _FRAMES).round().astype(int)
    hits = []
    for frame in frames:
        eye = camera_pose(camera, robot, reference.qpos[frame])[0]
        for body in reference.body_positions[frame]:
            # In lengths of the ray; what is close behind the surface of the terrain stands on it.
            distance = mujoco.mj_ray(model, data, eye, body - eye, None, 1, -1, geom)
            hits.append(0.0 <= distance < 0.98)
    return float(np.mean(hits))
