"""The array library of an array: the same functions serve numpy and torch."""

from __future__ import annotations

import sys
from typing import Any

Array = Any
"""An array of a library that follows the Python array API: numpy, torch, …"""


def array_namespace(*arrays: Array) -> Any:
    """Returns the module whose functions work on the given arrays.

    numpy arrays know their own namespace; torch tensors do not, but torch carries the same names.

    Raises:
        TypeError: The arrays belong to no known library.
    """
    array = arrays[0]
    find = getattr(array, "__array_namespace__", None)
    if find is not None:
        return find()
    torch = sys.modules.get("torch")
    if torch is not None and isinstance(array, torch.Tensor):
        return torch
    raise TypeError(f"Not an array of a known library: {type(array).__name__}")


def dot(a: Array, b: Array) -> Array:
    """Returns the inner products over the last axis."""
    return array_namespace(a).linalg.vecdot(a, b)
