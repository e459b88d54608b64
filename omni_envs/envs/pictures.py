"""Pictures of a simulation, its reference as a translucent ghost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from omni_envs.robots import Robot
from omni_envs.scenes import Scene
from omni_envs.tracking.motion import Frames

if TYPE_CHECKING:
    from omni_envs.scenes.rendering import SceneRenderer


class Pictures:
    """Renders simulations; graphics are only set up when something is rendered.

    Args:
        robot: The robot.
        scenes: The scenes.
        width: Pixels.
        height: Pixels.
    """

    def __init__(self, robot: Robot, scenes: Sequence[Scene], width: int, height: int) -> None:
        self._robot, self._scenes, self._size = robot, scenes, (width, height)
        self._renderers: dict[int, SceneRenderer] = {}

    def render(self, scene: int, qpos: np.ndarray, frames: Frames, row: int) -> np.ndarray:
        """Returns a (height, width, 3) uint8 picture.

        Args:
            scene: Index of the scene that the simulation is in.
            qpos: (nq,) state of the simulation, the object's pose last.
            frames: Reference frames of all simulations.
            row: The one that belongs to this simulation.
        """
        if scene not in self._renderers:
            from omni_envs.scenes.rendering import SceneRenderer

            width, height = self._size
            self._renderers[scene] = SceneRenderer(
                self._robot, self._scenes[scene], width=width, height=height
            )
        nq, poses = self._robot.nq, frames.object_pose
        return self._renderers[scene].render(
            qpos[:nq],
            None if poses is None else qpos[nq : nq + 7],
            ghost_qpos=frames.qpos[row],
            ghost_object_pose=None if poses is None else poses[row],
        )

    def close(self) -> None:
        """Frees the graphics context."""
        while self._renderers:
            self._renderers.popitem()[1].close()
