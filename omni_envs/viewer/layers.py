"""What can be seen of a frame of a reference beside robot and scene, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs import rotations
from omni_envs.demonstrations import SourceMotion
from omni_envs.metrics.playback import play
from omni_envs.references import Reference
from omni_envs.retargeting.interaction_mesh import connect
from omni_envs.retargeting.surface_points import surface_points
from omni_envs.robots import KEYPOINTS, SIDES, get_robot

TOLERANCE = 1e-3
"""Bodies deeper than this (m) in something are marked."""

TOUCHING, MISSING = (0.15, 0.65, 0.25), (0.95, 0.70, 0.10)
"""Colours of a link where the human touches something: the robot does too (within 2 cm), or not."""

_TOUCH = 0.02
_SURFACE_POINTS = 100
_LIMBS = (
    *((f"{side}_hip", f"{side}_knee") for side in SIDES),
    *((f"{side}_knee", f"{side}_ankle") for side in SIDES),
    *((f"{side}_ankle", f"{side}_toe") for side in SIDES),
    *((f"{side}_shoulder", f"{side}_elbow") for side in SIDES),
    *((f"{side}_elbow", f"{side}_hand") for side in SIDES),
    *(("pelvis", f"{side}_{joint}") for side in SIDES for joint in ("hip", "shoulder")),
    ("left_shoulder", "right_shoulder"),
)
BONES = np.array([[KEYPOINTS.index(a), KEYPOINTS.index(b)] for a, b in _LIMBS])
"""(L, 2) pairs of keypoints that are drawn as bones."""


@dataclass(frozen=True, eq=False)
class Marks:
    """Points with a colour.

    Attributes:
        points: (P, 3) in the world, m.
        colours: (P, 3) RGB, 0 to 1.
    """

    points: np.ndarray
    colours: np.ndarray


def mesh_edges(source: SourceMotion, frame: int) -> np.ndarray:
    """Returns the (E, 2, 3) edges of the interaction mesh that touch a keypoint, in the world.

    The body is the scaled human, the surroundings are the target's.
    """
    points = surface_points(source, _SURFACE_POINTS)
    target, local = _of_frame(points.target, frame), source.keypoints[frame]
    world = target
    if source.source_object_poses is not None and source.object_poses is not None:
        seen = source.object_poses if source.mesh_object_poses is None else source.mesh_object_poses
        here, there = source.source_object_poses[frame], seen[frame]
        local = rotations.rotate(rotations.conjugate(here[3:]), local - here[:3])
        world = there[:3] + rotations.rotate(there[3:], target)
    vertices = np.concatenate([local, _of_frame(points.source, frame)])
    body = len(local)
    adjacent = connect(vertices[None]).adjacency(0)[:body]
    first, second = np.nonzero(adjacent)
    once = (second >= body) | (first < second)
    shown = np.concatenate([source.keypoints[frame], world])
    return shown[np.stack([first[once], second[once]], axis=1)]


def contact_marks(reference: Reference, frame: int) -> Marks:
    """Returns the links that the human touches something with, coloured by what the robot does."""
    report, robot = reference.report, get_robot(reference.robot)
    points, colours = [], []
    for link, flags in reference.contacts.items():
        if not flags[frame]:
            continue
        distance = None if report is None else report.contact_distance.get(link)
        touching = distance is not None and distance[frame] <= _TOUCH
        body = robot.contact_links[link][-1]
        points.append(reference.body_positions[frame, reference.body_names.index(body)])
        colours.append(TOUCHING if touching else MISSING)
    return Marks(np.array(points).reshape(-1, 3), np.array(colours).reshape(-1, 3))


def violations(reference: Reference) -> list[np.ndarray]:
    """Returns, for each frame, (V,) places in ``body_names`` of bodies too deep in something."""
    played = play(
        get_robot(reference.robot),
        reference.scene,
        reference.fps,
        reference.qpos,
        reference.object_poses,
    )
    deep = np.flatnonzero(played.distance < -TOLERANCE)
    frames, bodies = played.frame[deep], played.body[deep]
    return [np.unique(bodies[frames == t]) for t in range(reference.num_frames)]


def _of_frame(points: np.ndarray, frame: int) -> np.ndarray:
    return points[frame] if points.ndim == 3 else points
