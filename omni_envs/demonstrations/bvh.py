"""BVH files: a skeleton, its channels, and the joint positions they give.

The reader is our own: the parsers on PyPI keep the whole text in memory as tokens, and answer a
damaged file with whatever exception the damage happens to cause.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from omni_envs.errors import FileFormatError

_AXES = {"x": 0, "y": 1, "z": 2}
END = "End"
"""Suffix that an end site adds to the name of its joint."""

_HEADER_BYTES = 4 << 20  # a hierarchy of 10 000 joints takes 1 MiB
_CHUNK_BYTES = 4 << 20
_BLOCK = 4096  # frames whose rotations are composed at a time
_HEADER = re.compile(r"\bMOTION\s+Frames:\s*(\S+)\s+Frame\s+Time:\s*(\S+)[^\S\n]*\n?")


@dataclass(frozen=True, eq=False)
class BvhJoint:
    """A joint of a BVH file.

    Attributes:
        name: Its name; an end site is named after its joint, with ``END``.
        parent: Index of its parent, −1 for the root.
        offset: (3,) rest position in the parent's frame, in file units.
        channels: Its channels in file order, such as ``"Xposition"`` or ``"Zrotation"``.
        end_site: Whether it only marks the end of its parent.
    """

    name: str
    parent: int
    offset: np.ndarray
    channels: tuple[str, ...]
    end_site: bool = False


@dataclass(frozen=True, eq=False)
class BvhMotion:
    """The content of a BVH file, in its own units and axes.

    Attributes:
        joints: Joints and end sites, parents first.
        frame_time: Seconds per frame, as the file says.
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
        placed = np.empty((len(self.values), len(self.joints), 3))
        for start in range(0, len(self.values), _BLOCK):
            block = slice(start, start + _BLOCK)
            placed[block] = self._positions(self.values[block])
        return placed

    def rest_positions(self) -> np.ndarray:
        """(J, 3) joints with every rotation zero, relative to the root, in file units and axes."""
        rest = np.zeros((len(self.joints), 3))
        for i, joint in enumerate(self.joints):
            if joint.parent >= 0:
                rest[i] = rest[joint.parent] + joint.offset
        return rest

    def _positions(self, values: np.ndarray) -> np.ndarray:
        frames = len(values)
        turns: list[np.ndarray] = []
        places: list[np.ndarray] = []
        column = 0
        for joint in self.joints:
            local = np.broadcast_to(joint.offset, (frames, 3)).copy()
            turn = np.broadcast_to(np.eye(3), (frames, 3, 3))
            for channel in joint.channels:
                axis, value = _AXES[channel[0].lower()], values[:, column]
                column += 1
                if channel.lower().endswith("position"):
                    local[:, axis] = value
                else:
                    turn = turn @ _about(axis, np.deg2rad(value))
            if joint.parent >= 0:
                local = places[joint.parent] + np.einsum("tij,tj->ti", turns[joint.parent], local)
                turn = turns[joint.parent] @ turn
            places.append(local)
            turns.append(turn)
        return np.stack(places, axis=1)


def read_bvh(path: str | Path, rows: Callable[[int, float], slice] | None = None) -> BvhMotion:
    """Reads a BVH file, in memory that grows only with the frames that are kept.

    Args:
        path: The file.
        rows: From the file's number of frames and its frame time the frames to keep, as a slice
            with a start, a stop and a positive step. None keeps all. Frames after the last one
            kept are not read.

    Raises:
        FileFormatError: The file is missing, truncated or not BVH, has two joints of one name, no
            frames, or values that are not finite.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing .bvh file", "nothing")
    with path.open("rb") as file:
        head = file.read(_HEADER_BYTES)
        text = head.decode("utf-8", errors="replace").removeprefix("\ufeff")
        if not re.match(r"\s*HIERARCHY\b", text) or not re.search(r"\bMOTION\b", text):
            expected = "a HIERARCHY and a MOTION section"
            raise FileFormatError(path, "content", expected, "other text" if text else "no text")
        header = _HEADER.search(text)
        if header is None:
            raise FileFormatError(path, "MOTION", "'Frames: n' and 'Frame Time: s'", "other text")
        joints = _hierarchy(path, text[: header.start()].split()[1:])
        frames, frame_time = (_number(path, "MOTION", word) for word in header.groups())
        if not 1 <= frames < 1e12 or frames != int(frames):
            raise FileFormatError(path, "Frames", "at least 1", header[1])
        if not 0 < frame_time < np.inf:
            raise FileFormatError(path, "Frame Time", "positive seconds", header[2])
        keep = slice(0, int(frames), 1) if rows is None else rows(int(frames), frame_time)
        channels = sum(len(joint.channels) for joint in joints)
        if not channels:
            raise FileFormatError(path, "CHANNELS", "at least one in the hierarchy", "none")
        rest = text[header.end() :].encode()
        values = _values(path, _words(path, rest, file), int(frames), channels, keep)
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        frame = keep.start + keep.step * int(np.argmax(bad))
        raise FileFormatError(
            path, "MOTION", "finite values", f"NaN or infinity first in frame {frame}"
        )
    return BvhMotion(joints, float(frame_time), values)


def _words(path: Path, first: bytes, file: BinaryIO) -> Iterator[list[bytes]]:
    """Yields the words that follow, a few megabytes of text at a time."""
    chunk = first
    while chunk:
        more = file.read(_CHUNK_BYTES)
        # A number may straddle two chunks: what follows the last blank waits for the next.
        cut = max(chunk.rfind(b) for b in (b" ", b"\n", b"\t", b"\r")) + 1 if more else len(chunk)
        words = chunk[:cut].split()
        chunk = chunk[cut:] + more
        if len(chunk) > 3 * _CHUNK_BYTES:
            raise FileFormatError(path, "MOTION", "numbers", "one word of several megabytes")
        yield words


def _values(
    path: Path, stream: Iterator[list[bytes]], frames: int, channels: int, keep: slice
) -> np.ndarray:
    """Picks the rows to keep from the stream of all words; those before are only counted."""
    kept = np.empty((len(range(frames)[keep]), channels))
    done, total = 0, 0  # whole rows and words seen
    pending: list[bytes] = []  # words of a row that is not yet complete
    for part in stream:
        total += len(part)
        words = pending + part
        whole = len(words) // channels
        pending = words[whole * channels :]
        if done + whole > keep.start:
            try:
                numbers = np.array(words[: whole * channels], dtype=float)
            except ValueError as error:
                raise FileFormatError(path, "MOTION", "numbers", str(error)[:120]) from error
            index = np.arange(max(done, keep.start), min(done + whole, keep.stop))
            index = index[(index - keep.start) % keep.step == 0]
            kept[(index - keep.start) // keep.step] = numbers.reshape(whole, channels)[index - done]
        done += whole
        if keep.stop < frames and done >= keep.stop:
            return kept
    if total != frames * channels:
        expected = f"{frames} frames of {channels} channels, {frames * channels} numbers"
        raise FileFormatError(path, "MOTION", expected, f"{total} numbers")
    return kept


def _hierarchy(path: Path, words: list[str]) -> tuple[BvhJoint, ...]:
    joints: list[BvhJoint] = []
    open_joints: list[int] = []
    name, offset, channels = "", np.zeros(3), ()  # type: tuple[str, np.ndarray, tuple[str, ...]]
    end_site = pending = False  # pending: a joint whose OFFSET and CHANNELS are being read

    def finish() -> None:
        nonlocal pending
        if pending:
            parent = open_joints[-2] if len(open_joints) > 1 else -1
            joints[open_joints[-1]] = BvhJoint(name, parent, offset, channels, end_site)
            pending = False

    stream = iter(words)
    try:
        for word in stream:
            if word in ("ROOT", "JOINT", "End"):
                finish()
                name, end_site = " ".join(iter(stream.__next__, "{")), word == "End"
                if end_site:
                    name = joints[open_joints[-1]].name + END
                offset, channels = np.zeros(3), ()
                open_joints.append(len(joints))
                joints.append(BvhJoint(name, -1, offset, ()))
                pending = True
            elif word == "OFFSET":
                offset = np.array([_number(path, f"OFFSET of {name}", next(stream)) for _ in "xyz"])
                if not np.isfinite(offset).all():
                    raise FileFormatError(path, f"OFFSET of {name}", "finite values", str(offset))
            elif word == "CHANNELS":
                count = _number(path, f"CHANNELS of {name}", next(stream))
                if not 0 <= count <= 6 or count != int(count):
                    raise FileFormatError(path, f"CHANNELS of {name}", "0 to 6", f"{count:g}")
                channels = tuple([next(stream) for _ in range(int(count))])
                for channel in channels:
                    if not re.fullmatch(r"(?i)[xyz](position|rotation)", channel):
                        expected = "Xposition … Zrotation"
                        raise FileFormatError(path, f"CHANNELS of {name}", expected, repr(channel))
            elif word == "}":
                finish()
                open_joints.pop()
            else:
                expected = "ROOT, JOINT, OFFSET, CHANNELS"
                raise FileFormatError(path, "HIERARCHY", expected, repr(word[:60]))
    except (StopIteration, RuntimeError, IndexError) as error:
        raise FileFormatError(path, "HIERARCHY", "a complete joint", "an early end") from error
    if open_joints or not joints:
        raise FileFormatError(path, "HIERARCHY", "as many '}' as '{'", "an early end")
    roots = [joint.name for joint in joints if joint.parent < 0]
    if len(roots) > 1:
        raise FileFormatError(path, "HIERARCHY", "one ROOT", f"{len(roots)}: {', '.join(roots)}")
    return _unique(path, joints)


def _unique(path: Path, joints: list[BvhJoint]) -> tuple[BvhJoint, ...]:
    """Refuses two joints of one name; end sites give way, for we made their names."""
    taken = [joint.name for joint in joints if not joint.end_site]
    twice = sorted({name for name in taken if taken.count(name) > 1})
    if twice:
        raise FileFormatError(path, "joints", "names that differ", f"several {', '.join(twice)}")
    used = set(taken)
    unique = []
    for joint in joints:
        name = joint.name
        while joint.end_site and name in used:
            name += "Site"
        used.add(name)
        unique.append(BvhJoint(name, joint.parent, joint.offset, joint.channels, joint.end_site))
    return tuple(unique)


def _number(path: Path, field: str, word: str) -> float:
    try:
        return float(word)
    except ValueError as error:
        raise FileFormatError(path, field, "a number", repr(word[:60])) from error


def _about(axis: int, angle: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotations about a coordinate axis."""
    turn = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[:, axis, axis] = 1.0
    turn[:, i, i] = turn[:, j, j] = np.cos(angle)
    turn[:, j, i] = np.sin(angle)
    turn[:, i, j] = -turn[:, j, i]
    return turn
