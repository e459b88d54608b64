"""``omni-envs convert``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from omni_envs.cli.output import console
from omni_envs.errors import InvalidOptionError

if TYPE_CHECKING:
    from omni_envs.scenes import Scene


@dataclass
class Convert:
    """A reference for another project, or another project's motion as a reference."""

    motion: tyro.conf.Positional[Path]
    """A reference, or a robot motion of another project (.npz, .csv)."""

    to: Literal[
        "reference",
        "omniretarget_dataset",
        "holosoma_retargeter",
        "holosoma_motion",
        "beyondmimic",
        "mjlab",
        "unitree_deploy",
        "unitree_csv",
    ]
    """Format to write."""

    out: Path
    """Where the file goes (.npz; unitree_csv: .csv)."""

    robot: str = "g1"
    """Robot of another project's motion."""

    source: str | None = None
    """What another project's motion was made from: a demonstration file or the name of a built-in
    one. It brings object, terrain and contacts."""

    object: Path | None = None
    """Mesh of the object at robot scale, where there is no source."""

    terrain: Path | None = None
    """Mesh of the terrain at robot scale, where there is no source."""

    fps: float | None = None
    """Frames per second of a motion whose file does not tell."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.demonstrations import load_demonstration
        from omni_envs.references import open_reference, save_motion

        if self.to == "reference" and self.out.suffix != ".npz":
            raise InvalidOptionError(f"--out {self.out}: must end in .npz.")
        demonstration = None if self.source is None else load_demonstration(self.source)
        reference = open_reference(
            self.motion, self.robot, demonstration, scene=self._scene(), fps=self.fps
        )
        if self.to == "reference":
            reference.save(self.out)
        else:
            save_motion(reference, self.out, self.to)
        rows = {
            "path": str(self.out),
            "format": self.to,
            "frames": reference.num_frames,
            "fps": reference.fps,
        }
        if self.json:
            print(json.dumps(rows))
        else:
            console.print(
                f"wrote {self.out}: {self.to}, {rows['frames']} frames at {reference.fps:g} fps"
            )

    def _scene(self) -> Scene | None:
        from omni_envs.scenes import Scene, SceneObject, Terrain, load_convex_parts

        if self.object is None and self.terrain is None:
            return None
        return Scene(
            object=None
            if self.object is None
            else SceneObject(self.object.stem, load_convex_parts(self.object)),
            terrain=None if self.terrain is None else Terrain(load_convex_parts(self.terrain)),
        )
