"""``omni-envs view``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from omni_envs.cli.output import console

if TYPE_CHECKING:
    from omni_envs.references import Reference


@dataclass
class View:
    """Look at a reference: in the browser, or as pictures."""

    reference: tyro.conf.Positional[Path]
    """A reference file."""

    strip: Path | None = None
    """Write a strip of pictures (.png) instead."""

    video: Path | None = None
    """Write a video (.mp4 or .gif) instead."""

    host: str = "127.0.0.1"
    """Address that the page is served on."""

    port: int = 8080
    """Port of the page; the next free one where it is in use."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.references import Reference

        reference = Reference.load(self.reference)
        if self.strip is None and self.video is None:
            self._serve(reference)
            return
        from omni_envs.viewer import reference_strip, reference_video

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

    def _serve(self, reference: Reference) -> None:
        from omni_envs.viewer import ReferencePage

        page = ReferencePage(reference, host=self.host, port=self.port)
        line = json.dumps({"url": page.url}) if self.json else f"{page.url} (Ctrl-C ends)"
        print(line, flush=True)
        try:
            page.run()
        finally:
            page.close()
