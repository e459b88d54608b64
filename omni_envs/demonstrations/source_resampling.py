"""A source motion at another frame rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from omni_envs.demonstrations.source_motion import SourceMotion
from omni_envs.resampling import frame_grid, resample_poses


def resample_source(source: SourceMotion, fps: float) -> SourceMotion:
    """Brings a source motion to another frame rate without inventing anything.

    Keypoints are interpolated linearly, objects on the manifold of poses. A new frame stands or
    touches exactly when the old frames on both sides of it do; it then touches the point between
    theirs. So a new schedule never holds where the old one does not, and a motion solved for
    the old schedules satisfies the new ones.

    Args:
        source: The motion.
        fps: New frames per second.

    Raises:
        InvalidDataError: The rate is not positive.
    """
    left, weight = frame_grid(source.num_frames, source.fps, fps)
    right = np.minimum(left + (weight > 0), source.num_frames - 1)

    def both(flags: np.ndarray) -> np.ndarray:
        return flags[left] & flags[right]

    def poses(at: np.ndarray | None) -> np.ndarray | None:
        return None if at is None else resample_poses(at, source.fps, fps)

    contacts = {link: both(np.asarray(flags, bool)) for link, flags in source.contacts.items()}
    points = {
        link: np.where(
            contacts[link][:, None], at[left] + weight[:, None] * (at[right] - at[left]), np.nan
        )
        for link, at in source.contact_points.items()
    }
    keypoints = source.keypoints[left]
    keypoints = keypoints + weight[:, None, None] * (source.keypoints[right] - keypoints)
    return replace(
        source,
        fps=float(fps),
        keypoints=keypoints,
        object_poses=poses(source.object_poses),
        source_object_poses=poses(source.source_object_poses),
        mesh_object_poses=poses(source.mesh_object_poses),
        stance={mode: both(np.asarray(flags, bool)) for mode, flags in source.stance.items()},
        contacts=contacts,
        contact_points=points,
    )
