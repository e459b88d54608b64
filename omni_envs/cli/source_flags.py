"""Flags that tell how to read a demonstration: the same wherever one is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from omni_envs.demonstrations.source_options import Unit, UpAxis

if TYPE_CHECKING:
    from omni_envs.demonstrations import Demonstration


@dataclass
class RecordingFlags:
    """What a file does not say, or says wrongly."""

    height: float | None = None
    """Standing height of the human in metres, where the source does not tell it."""

    up: UpAxis | None = None
    """Axis of the source that points up (--up=-y for a negative one); found by default."""

    unit: Unit | None = None
    """Length unit of the source; found by default."""

    fps_source: float | None = None
    """Frames per second of the source, where its file does not tell or is wrong."""

    start: float | None = None
    """Beginning of the part of the source to take, in seconds."""

    end: float | None = None
    """End of the part of the source to take, in seconds."""

    skeleton: str | None = None
    """Naming or order of the source's joints: a known name, or the YAML file that `omni-envs
    skeleton` writes."""

    def options(self) -> dict[str, Any]:
        """The flags as keywords of ``load_demonstration`` and ``SourceOptions``."""
        keywords = {name: getattr(self, name) for name in ("height", "up", "unit", "start", "end")}
        return keywords | {"fps": self.fps_source, "skeleton": self.skeleton}


@dataclass
class SourceFlags(RecordingFlags):
    """How to read a demonstration."""

    body_model: Path | None = None
    """SMPL body model (.npz) or folder of these, for SMPL parameters."""

    object: Path | None = None
    """Mesh of the object, where the source does not carry it."""

    terrain: Path | None = None
    """Mesh of the terrain at human scale, where it does not lie beside the source."""

    def load(self, source: str) -> Demonstration:
        """Loads a demonstration file, or a built-in one by name."""
        from omni_envs.demonstrations import load_demonstration

        return load_demonstration(
            source,
            object_mesh=self.object,
            terrain_mesh=self.terrain,
            body_model=self.body_model,
            **self.options(),
        )
