"""From joint positions in a file's own conventions to a demonstration."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from omni_envs.demonstrations.conventions import (
    LEG,
    check_sides,
    estimate_height,
    find_unit,
    find_up,
    leg_length,
    rest_up,
    turn_up,
)
from omni_envs.demonstrations.demonstration import Demonstration
from omni_envs.demonstrations.floor import level_floor
from omni_envs.demonstrations.footing import stand_on_ground
from omni_envs.demonstrations.namings import recognise, skeleton_map, skeleton_names
from omni_envs.demonstrations.resampling import FPS, resample_positions
from omni_envs.demonstrations.skeleton_map import SkeletonMap, joints_below
from omni_envs.demonstrations.source_options import METRES, SourceOptions, Unit, UpAxis
from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.robots import KEYPOINTS, SIDES
from omni_envs.scenes import Part, Scene, Terrain, load_convex_parts

_SHORTEST_BONE = 0.02  # of a leg; keypoints of one limb that are closer are one point
_MAX_HEIGHT = 3.0
_MISFIT = 1.3  # heights that differ by more from what the legs say are no human ones


@dataclass(frozen=True, eq=False)
class Recording:
    """What a reader took from a file, in the file's axes and units.

    Attributes:
        path: The file.
        joint_names: J joints, parents first.
        positions: (T, J, 3) world positions.
        fps: Frames per second of ``positions``.
        parents: (J,) index of every joint's parent, −1 for the root, where the file tells.
        rest: (J, 3) joints of the rest skeleton, where the file has one.
    """

    path: Path
    joint_names: tuple[str, ...]
    positions: np.ndarray
    fps: float
    parents: tuple[int, ...] | None = None
    rest: np.ndarray | None = None


@dataclass(frozen=True)
class Conventions:
    """How a recording was read.

    Attributes:
        up: Axis of the file that points up.
        unit: Its length unit.
        fps: Frames per second of the file, after thinning to a divisor of 30 where there is one.
        height: Standing height of the person, m.
    """

    up: UpAxis
    unit: Unit
    fps: float
    height: float


def map_joints(recording: Recording, options: SourceOptions) -> SkeletonMap:
    """The skeleton map that the user gave, or that of the naming the joints follow.

    Raises:
        FileFormatError: The joints follow no known naming, and there is no map.
        UnknownNameError: The user's skeleton is neither a known name nor a file.
    """
    names = recording.joint_names
    if options.skeleton is not None:
        return skeleton_map(options.skeleton, names, recording.path)
    found = recognise(names)
    if found is None:
        expected = f"a known naming ({', '.join(skeleton_names())}) or the option skeleton"
        hint = f"{', '.join(names[:8])} … (omni-envs skeleton {recording.path.name} proposes a map)"
        raise FileFormatError(recording.path, "joints", expected, hint)
    return found


def find_conventions(
    recording: Recording,
    joints: SkeletonMap,
    options: SourceOptions,
    *,
    up: UpAxis | None = None,
    unit: Unit | None = None,
    height: float | None = None,
    usual_up: UpAxis | None = None,
) -> Conventions:
    """Axes, unit and height: what the user says, else what the format fixes, else what is found.

    Args:
        recording: The recording.
        joints: Its skeleton map.
        options: What the user says.
        up: Up axis that the format fixes.
        unit: Unit that the format fixes.
        height: Height that the file states, m.
        usual_up: Up axis to take where the recording does not tell.

    Raises:
        FileFormatError: Something cannot be found, or is not human.
    """
    path, positions = recording.path, recording.positions
    keypoints = positions[:, _indices(recording, joints)]
    rest = None if recording.rest is None else recording.rest[_indices(recording, joints)]
    leg = leg_length(keypoints)
    if not leg > 0 or not np.isfinite(leg):
        raise FileFormatError(path, "joint positions", "legs with a length", f"length {leg:g}")
    unit = options.unit or unit or find_unit(path, leg)
    metres = METRES[unit]
    # Someone who states the unit may bring a child, but not a giant.
    if not 0.5 * LEG[0] <= leg * metres <= 1.5 * LEG[1]:
        expected = f"thigh and shin of {LEG[0]:.2f} to {LEG[1]:.2f} m"
        raise FileFormatError(path, "unit of length", expected, f"{leg * metres:.3g} m in {unit}")
    axis = options.up or up or find_up(keypoints, positions, rest, leg) or usual_up
    if axis is None:
        found = "a motion that does not tell"
        raise FileFormatError(path, "up axis", "one that stands out, or the option up", found)
    top = None
    if recording.rest is not None and joints.head_top is not None:
        top = recording.rest[recording.joint_names.index(joints.head_top)]
    height = options.height or height
    if height is None:
        stands = None if rest is None else rest_up(rest, leg)
        if rest is None or top is None or stands is None:
            height = estimate_height(leg * metres)
        else:
            upright, crown = (metres * turn_up(points, stands) for points in (rest, top))
            height = estimate_height(leg * metres, upright, crown)
    if not 0 < height < _MAX_HEIGHT:
        raise FileFormatError(path, "height", f"0 to {_MAX_HEIGHT:g} m", f"{height:.3g} m")
    usual = estimate_height(leg * metres)
    if not usual / _MISFIT < height < usual * _MISFIT:
        warnings.warn(
            f"{path}: a height of {height:.3g} m does not fit thighs and shins of "
            f"{leg * metres:.3g} m, as people of {usual:.3g} m have them. The motion is scaled by "
            "the height: a robot that it makes too small squats, one too large stretches. Give the "
            "height (--height) where the source is wrong about it.",
            stacklevel=3,
        )
    return Conventions(axis, unit, recording.fps, height)


def to_demonstration(
    recording: Recording,
    joints: SkeletonMap,
    conventions: Conventions,
    *,
    terrain_mesh: str | Path | None = None,
    scene: Scene | None = None,
    object_poses: np.ndarray | None = None,
    source: str = "",
    licence: str = "see the source of the file",
) -> Demonstration:
    """Turns a recording into a demonstration at 30 fps, z up, in metres.

    Where there is neither terrain nor object, a slight tilt of the recorded ground is taken out,
    and feet that stand are put on the ground.

    Args:
        recording: The recording.
        joints: Its skeleton map.
        conventions: Its axes, unit and height.
        terrain_mesh: Mesh of the terrain in the demonstration's axes, at human scale; None is flat
            ground.
        scene: Scene with an object, instead of terrain.
        object_poses: (T, 7) poses of the object at 30 fps, z up, m.
        source: Where the motion comes from.
        licence: Terms of the source.

    Raises:
        FileFormatError: Joints lie on top of each other, or left is not left.
    """
    path = recording.path
    skeleton = joints.fit(path, recording.joint_names, recording.parents)
    positions = METRES[conventions.unit] * turn_up(recording.positions, conventions.up)
    positions = resample_positions(positions, recording.fps)
    keypoints = positions[:, _indices(recording, joints)]
    _check_bones(path, keypoints)
    check_sides(path, keypoints)
    parts: tuple[Part, ...] = () if terrain_mesh is None else load_convex_parts(terrain_mesh)
    if terrain_mesh is None and object_poses is None:
        toes, knees = (
            [recording.joint_names.index(joints.keypoints[f"{side}_{part}"]) for side in SIDES]
            for part in ("toe", "knee")
        )
        feet = [_foot(recording, joints, side) for side in SIDES]
        positions = level_floor(positions, positions[:, toes], FPS)
        positions = stand_on_ground(positions, positions[:, toes], positions[:, knees], feet, FPS)
    if scene is None:
        scene = Scene(terrain=Terrain(parts) if parts else None)
    try:
        return Demonstration(
            name=path.stem,
            fps=FPS,
            joint_names=skeleton.joint_names,
            positions=positions,
            keypoint_joints=skeleton.keypoint_joints,
            height=conventions.height,
            scene=scene,
            object_poses=object_poses,
            contact_joints=skeleton.contact_joints,
            source=source,
            licence=licence,
        )
    except InvalidDataError as error:
        raise FileFormatError(path, error.field, "a valid demonstration", str(error)) from error


def _indices(recording: Recording, joints: SkeletonMap) -> list[int]:
    joints.fit(recording.path, recording.joint_names)
    return [recording.joint_names.index(joints.keypoints[k]) for k in KEYPOINTS]


def _foot(recording: Recording, joints: SkeletonMap, side: str) -> list[int]:
    """Indices of the joints of a foot: ankle, toe, and what else hangs on the ankle."""
    ankle, toe = (joints.keypoints[f"{side}_{part}"] for part in ("ankle", "toe"))
    names = {ankle, toe, *joints_below(ankle, recording.joint_names, recording.parents)}
    return [recording.joint_names.index(name) for name in sorted(names)]


def _check_bones(path: Path, keypoints: np.ndarray) -> None:
    leg = leg_length(keypoints)
    for chain in (("hip", "knee", "ankle", "toe"), ("shoulder", "elbow", "hand")):
        for side in SIDES:
            for upper, lower in pairwise(chain):
                a, b = (KEYPOINTS.index(f"{side}_{part}") for part in (upper, lower))
                bone = float(np.median(np.linalg.norm(keypoints[:, a] - keypoints[:, b], axis=-1)))
                if not bone > _SHORTEST_BONE * leg:
                    field = f"joints of {side}_{upper} and {side}_{lower}"
                    raise FileFormatError(path, field, "two places", "one place")
