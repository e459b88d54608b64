"""Array files from elsewhere, read without pickles and in bounded memory."""

from __future__ import annotations

import tokenize
import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy_format

from omni_envs.errors import FileFormatError

MAX_BYTES = 512 << 20
"""Largest array that is read from an archive: 100 000 frames of 200 joints are 480 MB."""

_MAGIC = {b"PK\x03\x04": "a .npz archive", b"\x80": "a pickle", b"\x93NUMPY": "a .npy array"}
_UNREADABLE = (
    OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError, SyntaxError,
    TypeError, AttributeError, zipfile.BadZipFile, zlib.error, MemoryError, OverflowError,
    tokenize.TokenError,  # of headers whose brackets stay open
)  # fmt: skip


def map_npy(path: str | Path, expected: str) -> np.ndarray:
    """Opens a ``.npy`` file of numbers without reading it: rows are read when they are used.

    Args:
        path: The file.
        expected: What the array should be, for error messages.

    Raises:
        FileFormatError: The file is missing, truncated, no ``.npy`` file, or holds Python objects.
    """
    path = existing(path, ".npy")
    _check_magic(path, b"\x93NUMPY", expected)
    try:
        with path.open("rb") as file:
            shape, _, dtype = _header(path, "content", file)
        if 0 in shape:  # nothing to map
            return np.empty(shape, dtype)
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except _UNREADABLE as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(path, "content", expected, short(error)) from error
    if array.dtype.kind not in "fiu":
        raise FileFormatError(path, "content", expected, f"values of type {array.dtype}")
    return array


def read_npz_members(
    path: str | Path, wanted: Collection[str] | None = None
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Reads arrays of a ``.npz`` archive.

    Members of Python objects are left out, never unpickled: motion files of others carry such
    fields beside the numbers. Sizes are checked before memory is taken.

    Args:
        path: The file.
        wanted: Names to read; None reads all.

    Returns:
        Name to array for those that are there and hold no Python objects, and the names of all
        members.

    Raises:
        FileFormatError: The file is missing or damaged, or an array is larger than ``MAX_BYTES``.
    """
    path = existing(path, ".npz")
    _check_magic(path, b"PK\x03\x04", "a .npz archive")
    arrays: dict[str, np.ndarray] = {}
    field = "file"
    try:
        with zipfile.ZipFile(path) as archive:
            members = [m for m in archive.infolist() if m.filename.endswith(".npy")]
            names = tuple(m.filename.removesuffix(".npy") for m in members)
            for name, member in zip(names, members, strict=True):
                if wanted is not None and name not in wanted:
                    continue
                field = f"array {name!r}"
                array = _read_member(path, field, archive, member)
                if array is not None:
                    arrays[name] = array
    except _UNREADABLE as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(path, field, "complete .npz data", short(error)) from error
    return arrays, names


def _read_member(
    path: Path, field: str, archive: zipfile.ZipFile, member: zipfile.ZipInfo
) -> np.ndarray | None:
    with archive.open(member) as file:
        shape, fortran, dtype = _header(path, field, file)
        if dtype.hasobject:
            return None
        count = 1
        for size in shape:
            count *= int(size)
        size = count * dtype.itemsize
        if size > MAX_BYTES:
            expected = f"at most {MAX_BYTES >> 20} MiB (a .npy may be longer: it is mapped)"
            raise FileFormatError(path, field, expected, f"shape {shape}, {size >> 20} MiB")
        if size > member.file_size:
            raise FileFormatError(path, field, f"{size} bytes", f"{member.file_size}: truncated")
        data = file.read(size)
    if len(data) != size:
        raise FileFormatError(path, field, f"{size} bytes", f"{len(data)}: truncated")
    array = np.frombuffer(data, dtype=dtype, count=count)
    return array.reshape(shape[::-1]).transpose() if fortran else array.reshape(shape)


def _header(path: Path, field: str, file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype]:
    version = npy_format.read_magic(file)
    if version == (1, 0):
        return npy_format.read_array_header_1_0(file)
    if version == (2, 0):
        return npy_format.read_array_header_2_0(file)
    raise FileFormatError(path, field, "version 1 or 2 of .npy", f"version {version}")


def existing(path: str | Path, suffix: str) -> Path:
    """Returns the path of a file that is there.

    Raises:
        FileFormatError: It is not.
    """
    path = Path(path)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "nothing"
        raise FileFormatError(path, "file", f"an existing {suffix} file", found)
    return path


def short(error: BaseException) -> str:
    """First line of an error, for a message of one line."""
    lines = str(error).strip().splitlines()
    return f"{type(error).__name__}: {lines[0][:120]}" if lines else type(error).__name__


def _check_magic(path: Path, magic: bytes, expected: str) -> None:
    with path.open("rb") as file:
        start = file.read(8)
    if start.startswith(magic):
        return
    found = "an empty file" if not start else "other data"
    for known, what in _MAGIC.items():
        if start.startswith(known):
            found = what
    raise FileFormatError(path, "content", expected, found)
