"""What has been made: one JSON line per finished item, safe against being killed at any moment."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from omni_envs.errors import OmniEnvsError
from omni_envs.files import complete_file
from omni_envs.generation.item import DONE, Item, file_hash

PATTERN = "manifest*.jsonl"
"""Names of manifests: every shard writes its own."""


class Manifest:
    """The rows of a dataset. A later row of the same name replaces an earlier one.

    Args:
        folder: The dataset.
        shard: (i, n): this is the i-th of n writers, from 1.
    """

    def __init__(self, folder: Path, shard: tuple[int, int] = (1, 1)) -> None:
        self.folder = folder
        number, count = shard
        name = "manifest.jsonl" if count == 1 else f"manifest-{number:04d}-of-{count:04d}.jsonl"
        self.path = folder / name
        self.rows: dict[str, dict[str, Any]] = {}
        for path in sorted(folder.glob(PATTERN)):
            self.rows |= {row["name"]: row for row in _lines(path)}

    def is_done(self, item: Item) -> bool:
        """Whether an item is there, made from the same things, and undamaged."""
        row = self.rows.get(item.name)
        if row is None or row.get("status") != DONE or row.get("key") != item.key:
            return False
        path = self.folder / item.file
        return path.is_file() and file_hash(path) == row.get("sha256")

    def add(self, row: dict[str, Any]) -> None:
        """Appends a row; it is on the disk when this returns."""
        self.folder.mkdir(parents=True, exist_ok=True)
        torn = self.path.is_file() and not self.path.read_bytes().endswith(b"\n")
        with self.path.open("a", encoding="utf-8") as file:
            # A writer that was killed may have left half a line: end it, so that it is skipped.
            file.write(("\n" if torn else "") + json.dumps(row, allow_nan=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self.rows[row["name"]] = row

    def tidy(self) -> None:
        """Leaves the newest row of every name in this writer's file, which is whole throughout."""
        if not self.path.is_file():
            return
        newest = {row["name"]: row for row in _lines(self.path)}
        text = "".join(json.dumps(row, allow_nan=False) + "\n" for row in newest.values())
        if text == self.path.read_text(encoding="utf-8", errors="replace"):
            return
        with complete_file(self.path) as temporary:
            temporary.write_text(text, encoding="utf-8")


@contextmanager
def sole_writer(folder: Path, shard: tuple[int, int]) -> Iterator[None]:
    """Keeps a second process from making the same part of a dataset at the same time.

    The lock goes with the process, even if it is killed.

    Raises:
        OmniEnvsError: Another process makes this part.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / ".{}-of-{}.lock".format(*shard)
    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise OmniEnvsError(
            f"Another process makes part {shard[0]}/{shard[1]} of {folder}. To share the work, "
            "give every process a part of its own: --shard 1/2 and --shard 2/2."
        ) from error
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        lock.release()


def _lines(path: Path) -> Iterable[dict[str, Any]]:
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue  # torn by a kill: its item counts as not done
        if isinstance(row, dict) and isinstance(row.get("name"), str):
            yield row
