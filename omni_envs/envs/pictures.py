"""Pictures of a simulation, its reference as a translucent ghost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from omni_envs.robots import Robot
from omni_envs.scenes import Scene
from omni_envs.tracking.motion import Frames

if TYPE_CHECKING:
    from omni_envs.scenes.rendering import SceneRenderer


class Pictures:
    """Renders simulations of one scene; graphics are only set up when something is rendered.

    Args:
        robot: The robot.
        scene: Its scene.
        width: Pixels.
        height: Pixels.
    """

    def __init__(self, robot: Robot, scene: Scene, width: int, height: int) -> None:
        self._robot, self._scene, self._size = robot, scene, (width, height)
        self._renderer: SceneRenderer | None = None

    def render(self, qpos: np.ndarray, frames: Frames, row: int) -> np.ndarray:
        """Returns a (height, width, 3) uint8 picture.

        Args:
            qpos: (nq,) state of the simulation, the object's pose last.
            frames: Reference frames of all simulations.
            row: The one that belongs to this simulation.
        """
        if self._renderer is None:
            from omni_envs.scenes.rendering import SceneRenderer

            width, height = self._size
            self._renderer = SceneRenderer(self._robot, self._scene, width=width, height=height)
        nq, poses = self._robot.nq, frames.object_pose
        return self._renderer.render(
            qpos[:nq],
            None if poses is None else qpos[nq : nq + 7],
            ghost_qpos=frames.qpos[row],
            ghost_object_pose=None if poses is None else poses[row],
        )

    def close(self) -> None:
        """Frees the graphics context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
