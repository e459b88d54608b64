"""BVH files: a skeleton, its channels, and the joint positions they give."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from omni_envs.errors import FileFormatError

_AXES = {"X": 0, "Y": 1, "Z": 2}
END = "End"
"""Suffix that an end site adds to the name of its joint."""


@dataclass(frozen=True, eq=False)
class BvhJoint:
    """A joint of a BVH file.

    Attributes:
        name: Its name; an end site is named after its joint, with ``END``.
        parent: Index of its parent, −1 for the root.
        offset: (3,) rest position in the parent's frame, in file units.
        channels: Its channels in file order, such as ``"Xposition"`` or ``"Zrotation"``.
    """

    name: str
    parent: int
    offset: np.ndarray
    channels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class BvhMotion:
    """The content of a BVH file, in its own units and axes.

    Attributes:
        joints: Joints and end sites, parents first.
        frame_time: Seconds per frame.
        values: (T, C) channel values in file order, degrees and file units.
    """

    joints: tuple[BvhJoint, ...]
    frame_time: float
    values: np.ndarray

    def positions(self) -> np.ndarray:
        """Returns (T, J, 3) world positions of joints and end sites, in file units.

        Rotations are composed in the order in which the file declares a joint's channels. Position
        channels replace the joint's OFFSET, as every exporter writes them: they are absolute for
        the root.
        """
        frames = len(self.values)
        turns: list[np.ndarray] = []
        places: list[np.ndarray] = []
        column = 0
        for joint in self.joints:
            local = np.broadcast_to(joint.offset, (frames, 3)).copy()
            turn = np.broadcast_to(np.eye(3), (frames, 3, 3))
            for channel in joint.channels:
                axis, value = _AXES[channel[0]], self.values[:, column]
                column += 1
                if channel.endswith("position"):
                    local[:, axis] = value
                else:
                    turn = turn @ _about(axis, np.deg2rad(value))
            if joint.parent >= 0:
                local = places[joint.parent] + np.einsum("tij,tj->ti", turns[joint.parent], local)
                turn = turns[joint.parent] @ turn
            places.append(local)
            turns.append(turn)
        return np.stack(places, axis=1)


def read_bvh(path: str | Path) -> BvhMotion:
    """Reads a BVH file.

    Raises:
        FileFormatError: The file is missing, truncated or not BVH, or has no frames or values that
            are not finite.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing .bvh file", "nothing")
    words = path.read_text(encoding="utf-8", errors="replace").split()
    if "MOTION" not in words or words[:1] != ["HIERARCHY"]:
        raise FileFormatError(path, "content", "a HIERARCHY and a MOTION section", "other text")
    start = words.index("MOTION")
    joints = _hierarchy(path, words[1:start])
    motion = words[start + 1 :]
    if motion[:1] != ["Frames:"] or motion[2:4] != ["Frame", "Time:"] or len(motion) < 5:
        raise FileFormatError(path, "MOTION", "'Frames: n' and 'Frame Time: s'", "other text")
    frames, frame_time = (_number(path, "MOTION", word) for word in (motion[1], motion[4]))
    if frames < 1 or frames != int(frames):
        raise FileFormatError(path, "Frames", "at least 1", motion[1])
    if not 0 < frame_time < np.inf:
        raise FileFormatError(path, "Frame Time", "positive seconds", motion[4])
    channels = sum(len(joint.channels) for joint in joints)
    try:
        values = np.array(motion[5:], dtype=float)
    except ValueError as error:
        raise FileFormatError(path, "MOTION", "numbers", str(error)) from error
    if len(values) != int(frames) * channels:
        expected = f"{int(frames)} frames of {channels} channels, {int(frames) * channels} numbers"
        raise FileFormatError(path, "MOTION", expected, f"{len(values)} numbers")
    values = values.reshape(int(frames), channels)
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        found = f"NaN or infinity first in frame {int(np.argmax(bad))}"
        raise FileFormatError(path, "MOTION", "finite values", found)
    return BvhMotion(joints, float(frame_time), values)


def _hierarchy(path: Path, words: list[str]) -> tuple[BvhJoint, ...]:
    joints: list[BvhJoint] = []
    open_joints: list[int] = []
    name, offset, channels = "", np.zeros(3), ()  # type: tuple[str, np.ndarray, tuple[str, ...]]
    pending = False  # a joint whose OFFSET and CHANNELS are being read

    def finish() -> None:
        nonlocal pending
        if pending:
            parent = open_joints[-2] if len(open_joints) > 1 else -1
            joints[open_joints[-1]] = BvhJoint(name, parent, offset, channels)
            pending = False

    stream = iter(words)
    try:
        for word in stream:
            if word in ("ROOT", "JOINT", "End"):
                finish()
                name = next(stream)
                if word == "End":
                    name = joints[open_joints[-1]].name + END
                offset, channels = np.zeros(3), ()
            elif word == "{":
                open_joints.append(len(joints))
                joints.append(BvhJoint(name, -1, offset, ()))
                pending = True
            elif word == "OFFSET":
                offset = np.array([_number(path, f"OFFSET of {name}", next(stream)) for _ in "xyz"])
            elif word == "CHANNELS":
                count = int(_number(path, f"CHANNELS of {name}", next(stream)))
                channels = tuple(next(stream) for _ in range(count))
                for channel in channels:
                    if channel[:1] not in _AXES or channel[1:] not in ("position", "rotation"):
                        expected = "Xposition … Zrotation"
                        raise FileFormatError(path, f"CHANNELS of {name}", expected, channel)
            elif word == "}":
                finish()
                open_joints.pop()
            else:
                raise FileFormatError(path, "HIERARCHY", "ROOT, JOINT, OFFSET, CHANNELS", word)
    except (StopIteration, RuntimeError, IndexError) as error:
        raise FileFormatError(path, "HIERARCHY", "a complete joint", "an early end") from error
    if open_joints or not joints:
        raise FileFormatError(path, "HIERARCHY", "as many '}' as '{'", "an early end")
    return tuple(joints)


def _number(path: Path, field: str, word: str) -> float:
    try:
        return float(word)
    except ValueError as error:
        raise FileFormatError(path, field, "a number", repr(word)) from error


def _about(axis: int, angle: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotations about a coordinate axis."""
    turn = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[:, axis, axis] = 1.0
    turn[:, i, i] = turn[:, j, j] = np.cos(angle)
    turn[:, j, i] = np.sin(angle)
    turn[:, i, j] = -turn[:, j, i]
    return turn
