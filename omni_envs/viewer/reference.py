"""Looking at a reference: a strip of pictures over time, or a video."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from omni_envs.references import Reference
from omni_envs.robots import get_robot
from omni_envs.scenes.rendering import Camera, SceneRenderer
from omni_envs.viewer.pictures import (
    PICTURE_SUFFIXES,
    VIDEO_SUFFIXES,
    checked_path,
    picture_strip,
    write_picture,
    write_video,
)
from omni_envs.viewer.viewpoint import choose_camera


def reference_frames(
    reference: Reference,
    indices: np.ndarray | None = None,
    *,
    camera: Camera | None = None,
    width: int = 480,
    height: int = 480,
    keypoints: bool = True,
) -> Iterator[np.ndarray]:
    """Renders frames of a reference, the human keypoints as red dots where the reference has them.

    Args:
        reference: What to show.
        indices: Frames to show, all by default.
        camera: Where from; by default ``choose_camera`` decides.
        width: Pixels.
        height: Pixels.
        keypoints: Show the scaled human keypoints.

    Yields:
        (height, width, 3) uint8 pictures.
    """
    robot = get_robot(reference.robot)
    renderer = SceneRenderer(robot, reference.scene, ghosts=0, width=width, height=height)
    camera = camera or choose_camera(reference)
    source = reference.source
    try:
        for t in range(len(reference.qpos)) if indices is None else indices:
            points = None
            if keypoints and source is not None:
                points = source.keypoints[min(int(t), source.num_frames - 1)]
            poses = reference.object_poses
            yield renderer.render(
                reference.qpos[t],
                None if poses is None else poses[t],
                camera=camera,
                points=points,
            ).copy()
    finally:
        renderer.close()


def reference_strip(
    reference: Reference,
    path: str | Path,
    *,
    pictures: int = 12,
    columns: int = 6,
    colours: int | None = None,
) -> Path:
    """Writes evenly spaced frames of a reference as one picture.

    Args:
        reference: What to show.
        path: ``.png`` or ``.jpg``.
        pictures: How many frames.
        columns: How many in a row.
        colours: Most colours of a ``.png``, all by default.

    Returns:
        The path.
    """
    path = checked_path(path, PICTURE_SUFFIXES, "picture")
    indices = np.linspace(0, len(reference.qpos) - 1, pictures).round().astype(int)
    frames = list(reference_frames(reference, indices, width=360, height=400))
    return write_picture(path, picture_strip(frames, columns), colours=colours)


def reference_video(reference: Reference, path: str | Path, *, every: int = 2) -> Path:
    """Writes a reference as a video in real time.

    Args:
        reference: What to show.
        path: ``.mp4`` or ``.gif``.
        every: Shows one of so many frames.

    Returns:
        The path.
    """
    path = checked_path(path, VIDEO_SUFFIXES, "video")
    indices = np.arange(0, len(reference.qpos), every)
    robot = get_robot(reference.robot)
    camera = replace(choose_camera(reference), distance=2.3 * robot.height)  # calmer from afar
    return write_video(
        path, reference_frames(reference, indices, camera=camera), reference.fps / every
    )
