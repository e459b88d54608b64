"""YAML of users: read as plain data, with one error for whatever is wrong with it."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from omni_envs.errors import FileFormatError

MAX_BYTES = 1 << 20
"""Size of a file that people write by hand, at most."""


def read_yaml(path: Path, most_bytes: int = MAX_BYTES) -> Any:
    """Reads a YAML file. Tags that make objects are refused, and so are keys that repeat.

    Args:
        path: The file.
        most_bytes: Larger files are refused: YAML takes a hundred times its size to read.

    Raises:
        FileFormatError: The file is missing, too large or no such YAML.
    """
    if not path.is_file():
        raise FileFormatError(path, "file", "an existing YAML file", "nothing")
    if path.stat().st_size > most_bytes:
        found = f"{path.stat().st_size} bytes"
        raise FileFormatError(path, "file", f"a YAML file of at most {most_bytes >> 20} MiB", found)
    try:
        return yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except (yaml.YAMLError, ValueError, RecursionError, OverflowError, OSError) as error:
        found = " ".join(str(error).split())[:160]
        raise FileFormatError(path, "content", "YAML", found) from error


class _Loader(yaml.SafeLoader):
    """The safe loader, which would keep the last of two equal keys without a word."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for number, key in enumerate(keys):
            if key in keys[:number] and key != "<<":
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} twice", node.start_mark
                )
        return super().construct_mapping(node, deep)
