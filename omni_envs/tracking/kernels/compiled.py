"""How the loops of this folder are compiled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.compilation import Compiler

Array = np.ndarray
Tuple = Any
"""A few numbers: a tuple or a row of an array."""

_HERE = Path(__file__).parent

compiled = Compiler(
    # ``Bodies`` and ``Columns`` are tuples whose order is compiled in.
    _HERE,
    _HERE.parent / "alignment.py",
    _HERE.parent / "motion.py",
    error_model="numpy",
)
"""The decorator. No fast mathematics: the same input gives the same bits."""
