"""Files of named arrays: one ``.npz`` without pickles, written atomically, checked when read."""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from tokenize import TokenError

import numpy as np

from omni_envs.errors import FileFormatError, InvalidDataError
from omni_envs.files import complete_file

DIGEST = "content_sha256"
"""Name of the array that holds the hash of all others."""


def digest(arrays: Mapping[str, np.ndarray]) -> str:
    """Returns the SHA-256 of names, types, shapes and values, whatever their order."""
    sha = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        sha.update(f"{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        sha.update(array.tobytes())
    return sha.hexdigest()


def write_npz(path: str | Path, arrays: Mapping[str, np.ndarray]) -> Path:
    """Writes arrays to a file that is either complete or not there, even if the writer is killed.

    Args:
        path: The file; its folder is made where needed.
        arrays: Name to array. Arrays of Python objects are refused.

    Returns:
        The path.

    Raises:
        InvalidDataError: An array of Python objects.
    """
    plain = {name: np.asarray(array) for name, array in arrays.items()}
    for name, array in plain.items():
        if array.dtype.hasobject:
            raise InvalidDataError(str(path), name, "numbers, flags or text", "Python objects")
    plain[DIGEST] = np.array(digest(plain))
    with complete_file(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **plain)
    return Path(path)


def read_npz(path: str | Path, *, checked: bool = True) -> dict[str, np.ndarray]:
    """Reads all arrays of a file.

    Args:
        path: The file.
        checked: Require the hash that ``write_npz`` stores. Files of other programs have none.

    Returns:
        Name to array.

    Raises:
        FileFormatError: The file is missing, is no ``.npz``, is damaged or holds Python objects.
    """
    path = Path(path)
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing .npz file", "nothing")
    with path.open("rb") as start:
        if start.read(2) != b"PK":  # NumPy would speak of pickles
            found = "another kind of file" if path.stat().st_size else "an empty file"
            raise FileFormatError(path, "file", "a complete .npz archive", found)
    try:
        file = np.load(path, allow_pickle=False)
        if isinstance(file, np.ndarray):
            raise ValueError("a single array")
        with file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, KeyError, NotImplementedError) as error:
        raise FileFormatError(path, "file", "a complete .npz archive", _short(error)) from error
    except (zipfile.BadZipFile, zlib.error, SyntaxError, TokenError, MemoryError) as error:
        raise FileFormatError(path, "file", "a complete .npz archive", _short(error)) from error
    if checked:
        stored = arrays.pop(DIGEST, None)
        if stored is None:
            raise FileFormatError(path, DIGEST, "the hash of the content", "no such array")
        if str(stored) != digest(arrays):
            raise FileFormatError(path, DIGEST, "the hash of the content", "another hash: damaged")
    return arrays


def _short(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return f"{type(error).__name__}: {lines[0][:120]}" if lines else type(error).__name__
