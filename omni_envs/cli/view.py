"""``omni-envs view``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import tyro

from omni_envs.cli.output import console
from omni_envs.errors import InvalidOptionError


@dataclass
class View:
    """Look at a reference."""

    reference: tyro.conf.Positional[Path]
    """A reference file."""

    strip: Path | None = None
    """Write a strip of pictures (.png)."""

    video: Path | None = None
    """Write a video (.mp4 or .gif)."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.references import Reference
        from omni_envs.viewer import reference_strip, reference_video

        if self.strip is None and self.video is None:
            raise InvalidOptionError("omni-envs view: give --strip PNG, --video MP4, or both.")
        reference = Reference.load(self.reference)
        paths = []
        if self.strip is not None:
            paths.append(reference_strip(reference, self.strip))
        if self.video is not None:
            paths.append(reference_video(reference, self.video))
        if self.json:
            print(json.dumps({"path": [str(p) for p in paths]}))
        else:
            for path in paths:
                console.print(f"wrote {path}")
