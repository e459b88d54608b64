"""What is found in a recording before anything is made of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from omni_envs.demonstrations.bvh_source import record_bvh
from omni_envs.demonstrations.joint_arrays import name_joints, record_joint_array
from omni_envs.demonstrations.namings import recognise, skeleton_map
from omni_envs.demonstrations.recording import Conventions, find_conventions
from omni_envs.demonstrations.skeleton_guess import Guess, guess_skeleton
from omni_envs.demonstrations.skeleton_map import SkeletonMap
from omni_envs.demonstrations.source_options import SourceOptions, UpAxis
from omni_envs.errors import FileFormatError

SUFFIXES = (".bvh", ".npy", ".npz")
"""Files whose skeletons differ; the other formats have one each."""


@dataclass(frozen=True)
class Inspection:
    """A recording at a glance.

    Attributes:
        path: The file.
        known: Name of the naming that the joints follow, or of the map that was given; None where
            the map is a proposal.
        guess: The map, how well the names fit, and the joints that play nothing.
        frames: Frames after thinning.
        conventions: Axes, unit, rate and height, or None where they cannot be found.
        problem: Why they cannot.
    """

    path: Path
    known: str | None
    guess: Guess
    frames: int
    conventions: Conventions | None
    problem: str | None = None


def inspect_recording(path: str | Path, options: SourceOptions | None = None) -> Inspection:
    """Finds skeleton, axes, unit, rate and height of a BVH file or of joint positions.

    Args:
        path: ``.bvh``, ``.npy`` or ``.npz`` file.
        options: What the user knows already.

    Raises:
        FileFormatError: The file cannot be read, or its joints are not those of a person.
    """
    options = SourceOptions() if options is None else options
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        expected = f"one that ends in {', '.join(SUFFIXES)}: other formats have one skeleton each"
        raise FileFormatError(path, "file name", expected, path.name)
    if suffix == ".bvh":
        recording = record_bvh(path, options)
    else:
        recording = name_joints(record_joint_array(path, options), options)
    names = recording.joint_names
    found: SkeletonMap | None
    if options.skeleton is not None:
        found = skeleton_map(options.skeleton, names, path)
    else:
        found = recognise(names)
    if found is None:
        guess = guess_skeleton(recording)
    else:
        found.fit(path, names)
        unused = tuple(name for name in names if name not in found.joints)
        guess = Guess(found, dict.fromkeys(found.keypoints, 1.0), unused)
    usual: UpAxis | None = "y" if suffix == ".bvh" else None
    known = None if found is None else found.name
    inspection = Inspection(path, known, guess, len(recording.positions), None)
    try:
        conventions = find_conventions(recording, guess.skeleton, options, usual_up=usual)
    except FileFormatError as error:
        return replace(inspection, problem=str(error))
    return replace(inspection, conventions=conventions)
