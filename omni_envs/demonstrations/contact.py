"""Where the person touches the object, the terrain or the ground.

A link touches on a frame when the source says so (contact flags), else when one of its contact
joints comes within 2 cm of the surface (a joint inside counts too). What it touches is the middle
of the patch below all of its joints that touch. Objects are judged at human scale, where hands and
object were recorded together; terrain at robot scale, where the robot meets it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.surface import closest_points, exposed_points
from omni_envs.rotations import conjugate, rotate
from omni_envs.scenes import Terrain

DISTANCE = 0.02
"""A joint within this distance of a surface touches it, m."""

KNEE_RADIUS = 0.04
"""A knee joint lies inside the knee, about this deep under the skin at human scale, m."""

_BEFORE = {"hand": "elbow", "knee": "hip", "foot": "knee"}
"""The keypoint that each kind of link hangs on."""

_Projection = Callable[[str, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
_Contacts = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]


def object_contacts(demonstration: Demonstration) -> _Contacts:
    """Contacts with the object: link to (T,) bool, and link to (T, 3) points in its frame, m."""
    assert demonstration.scene.object is not None and demonstration.object_poses is not None
    parts, poses = demonstration.scene.object.parts, demonstration.object_poses[:, None]
    positions = rotate(conjugate(poses[..., 3:]), demonstration.positions - poses[..., :3])
    return _contacts(demonstration, positions, lambda link, p, eyes: closest_points(parts, p), 1.0)


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

    def project(link: str, points: np.ndarray, eyes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        closest, distance = exposed_points(parts, points, not link.endswith("foot"), eyes)
        if uneven is not None:
            found, gap = uneven.closest_points(points)
            closest = np.where((gap < distance)[:, None], found, closest)
            distance = np.minimum(distance, gap)
        return closest, distance

    return _contacts(demonstration, positions, project, scale)


def _contacts(
    demonstration: Demonstration,
    positions: np.ndarray,
    project: _Projection,
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
        side, kind = link.split("_")
        before = demonstration.keypoint_joints[f"{side}_{_BEFORE[kind]}"]
        eyes = positions[:, names.index(before)]
        each = np.repeat(eyes, len(joints), axis=0)
        closest, distance = project(link, points.reshape(-1, 3), each)
        distance = distance.reshape(frames, -1)
        depth = KNEE_RADIUS * scale if link.endswith("knee") else 0.0
        flags = demonstration.contacts.get(link, distance.min(axis=1) <= DISTANCE + depth)
        contacts[link] = np.array(flags, bool)
        touched[link] = np.full((frames, 3), np.nan)
        touching = contacts[link]
        patch = _patch(closest.reshape(frames, -1, 3)[touching], distance[touching])
        touched[link][touching] = project(link, patch, eyes[touching])[0]
    return contacts, touched


def _patch(closest: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """(T, 3) middle of the touched patch, from the projections of (T, J) joints.

    A joint counts the less the less deep it is than the deepest one, so the middle does not jump
    from finger to finger as the deepest one does.
    """
    behind = distance - distance.min(axis=1, keepdims=True)
    weights = np.maximum(1.0 - behind / DISTANCE, 0.0)
    return (weights[..., None] * closest).sum(axis=1) / weights.sum(axis=1, keepdims=True)
