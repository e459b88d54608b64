"""The profiles: conventions of the stacks that policy files are for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omni_envs.export.beyondmimic import BeyondMimicGraph, write_beyondmimic
from omni_envs.export.graph import PolicyGraph
from omni_envs.export.holosoma import HolosomaGraph, write_holosoma
from omni_envs.export.unitree import UnitreeGraph, write_unitree


@dataclass(frozen=True)
class Profile:
    """A convention.

    Attributes:
        graph: Actor and description to graph.
        write: Graph, description, file and origin to the files that were written, policy first.
    """

    graph: Callable[..., PolicyGraph]
    write: Callable[[Any, Any, Path, str], list[Path]]


WRITERS = {
    "beyondmimic": Profile(BeyondMimicGraph, write_beyondmimic),
    "holosoma": Profile(HolosomaGraph, write_holosoma),
    "unitree": Profile(UnitreeGraph, write_unitree),
}
"""Name to profile."""
