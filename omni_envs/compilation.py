"""Loops compiled by numba when they are first called, and kept on disk until a source changes.

Numba's own cache looks at the file of a function alone: after a change in another file a function
would go on with what it had called there before. Here it looks at all files that belong together.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache


class Compiler:
    """A decorator that compiles functions.

    The result is kept next to the file of the function, or in the user's cache directory where that
    cannot be written; where neither can, every process compiles anew.

    Attributes:
        sources: All that compiled code is made of: a change in any of these files has it made anew.

    Args:
        *sources: Files, and folders of files: those of the functions, of all functions that they
            call, and of what these name from other files.
        **options: Of ``numba.njit``.
    """

    def __init__(self, *sources: str | Path, **options: Any) -> None:
        paths = [Path(source) for source in sources]
        files = [sorted(p.glob("*.py")) if p.is_dir() else [p] for p in paths]
        self.sources = tuple(file for group in files for file in group)
        digest = hashlib.sha256()
        for file in self.sources:
            content = file.read_bytes()
            digest.update(f"{file.name} {len(content)}\n".encode() + content)
        self._stamp, self._options = digest.hexdigest(), options

    def __call__(self, function: Callable[..., Any]) -> Any:
        """Returns the function, to be compiled when it is first called."""
        dispatcher = njit(nogil=True, **self._options)(function)
        try:
            dispatcher._cache = _Cache(function, self._stamp)
        except RuntimeError:  # there is no place to write to
            dispatcher._cache = _NoCache()
        return dispatcher


class _Cache(FunctionCache):
    """Numba's cache of a function, which holds for one stamp of its sources."""

    def __init__(self, function: Callable[..., Any], stamp: str) -> None:
        super().__init__(function)
        self._cache_file = IndexDataCacheFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = super().load_overload(sig, target_context)
        if found is None:
            _tell("this takes some seconds, once")
        return found


class _NoCache(NullCache):
    def load_overload(self, sig: Any, target_context: Any) -> None:
        _tell("this takes some seconds every time, as there is no folder to keep the result in")


_told = False


def _tell(duration: str) -> None:
    """Says on stderr, once per program, that something takes long."""
    global _told
    if not _told and parent_process() is None:
        print(f"omni_envs: compiling inner loops for this machine; {duration}.", file=sys.stderr)
    _told = True
