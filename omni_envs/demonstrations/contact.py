"""Where the person touches the object, the terrain or the ground.

A link touches on a frame when the source says so (contact flags), else when one of its contact
joints comes within 2 cm of the surface (a joint inside counts too). Objects are judged at human
scale, where hands and object were recorded together; terrain at robot scale, where the robot meets
it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.surface import closest_points
from omni_envs.rotations import conjugate, rotate
from omni_envs.scenes import Terrain

DISTANCE = 0.02
"""A joint within this distance of a surface touches it, m."""

KNEE_RADIUS = 0.04
"""A knee joint lies inside the knee, about this deep under the skin at human scale, m."""

_Projection = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
_Contacts = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]


def object_contacts(demonstration: Demonstration) -> _Contacts:
    """Contacts with the object: link to (T,) bool, and link to (T, 3) points in its frame, m."""
    assert demonstration.scene.object is not None and demonstration.object_poses is not None
    parts, poses = demonstration.scene.object.parts, demonstration.object_poses[:, None]
    positions = rotate(conjugate(poses[..., 3:]), demonstration.positions - poses[..., :3])
    return _contacts(demonstration, positions, lambda link, p: closest_points(parts, p), 1.0)


def terrain_contacts(
    demonstration: Demonstration, positions: np.ndarray, terrain: Terrain | None, scale: float
) -> _Contacts:
    """Contacts with terrain, and of hands and knees with the ground too.

    Feet on flat ground are left to the stance schedule.

    Args:
        demonstration: The demonstration.
        positions: (T, J, 3) its joints at robot scale, m.
        terrain: Terrain at robot scale, if any.
        scale: Robot height / human height.

    Returns:
        Link to (T,) bool, and link to (T, 3) touched points in the world, m.
    """
    parts = terrain.parts if terrain is not None else ()
    uneven = terrain.heightfield if terrain is not None else None

    def project(link: str, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        closest, distance = closest_points(parts, points)
        if uneven is not None:
            found, gap = uneven.closest_points(points)
            closest = np.where((gap < distance)[:, None], found, closest)
            distance = np.minimum(distance, gap)
        if not link.endswith("foot"):
            ground = points[:, 2] < distance
            closest[ground] = points[ground] * (1.0, 1.0, 0.0)
            distance = np.minimum(distance, points[:, 2])
        return closest, distance

    return _contacts(demonstration, positions, project, scale)


def _contacts(
    demonstration: Demonstration,
    positions: np.ndarray,
    project: Callable[[str, np.ndarray], tuple[np.ndarray, np.ndarray]],
    scale: float,
) -> _Contacts:
    names, frames = demonstration.joint_names, demonstration.num_frames
    contacts: dict[str, np.ndarray] = {}
    touched: dict[str, np.ndarray] = {}
    for link in [*demonstration.contacts, *demonstration.contact_joints]:
        if link in contacts:
            continue
        joints = demonstration.contact_joints.get(link)
        if joints is None:  # flagged, but with no joints of its own: its keypoint stands for it
            part = link.replace("foot", "toe")
            joints = (demonstration.keypoint_joints[part],)
        points = positions[:, [names.index(j) for j in joints]]
        closest, distance = project(link, points.reshape(-1, 3))
        distance = distance.reshape(frames, -1)
        nearest = np.argmin(distance, axis=1)
        rows = np.arange(frames)
        depth = KNEE_RADIUS * scale if link.endswith("knee") else 0.0
        flags = demonstration.contacts.get(link, distance[rows, nearest] <= DISTANCE + depth)
        contacts[link] = np.array(flags, bool)
        at = closest.reshape(frames, -1, 3)[rows, nearest]
        touched[link] = np.where(contacts[link][:, None], at, np.nan)
    return contacts, touched
