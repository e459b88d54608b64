"""``omni-envs skeleton``."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import tyro
import yaml

from omni_envs.cli.source_flags import RecordingFlags


@dataclass
class Skeleton:
    """Which joint of a recording plays which keypoint: look, correct, and give it to --skeleton."""

    source: tyro.conf.Positional[Path]
    """A BVH file, or joint positions (.npy, .npz)."""

    recording: RecordingFlags = field(default_factory=RecordingFlags)

    out: Path | None = None
    """Write the map here (.yaml)."""

    json: bool = False
    """Print JSON."""

    def run(self) -> None:  # noqa: D102
        from omni_envs.demonstrations import SourceOptions, inspect_recording

        seen = inspect_recording(self.source, SourceOptions(**self.recording.options()))
        text = seen.guess.skeleton.to_yaml()
        if self.out is not None:
            self.out.parent.mkdir(parents=True, exist_ok=True)
            self.out.write_text(text, encoding="utf-8")
        if self.json:
            conventions = None if seen.conventions is None else asdict(seen.conventions)
            rows = {
                "known": seen.known,
                "map": yaml.safe_load(text),
                "scores": {k: round(v, 3) for k, v in seen.guess.scores.items()},
                "doubtful": seen.guess.doubtful,
                "unused": seen.guess.unused,
                "frames": seen.frames,
                "conventions": conventions,
                "problem": seen.problem,
            }
            print(json.dumps(rows))
            return
        how = (
            f"the naming {seen.known!r}" if seen.known else "no known naming: a proposal, check it"
        )
        print(f"# {self.source.name}: {how}")
        if seen.conventions is not None:
            c = seen.conventions
            print(f"# {seen.frames} frames at {c.fps:g} fps, {seen.frames / c.fps:.1f} s")
            print(f"# {c.up} up, {c.unit}, a person of {c.height:.2f} m")
        else:
            print(f"# {seen.problem}")
        print(f"# {len(seen.guess.scores)} of 15 keypoints have a joint")
        for keypoint in seen.guess.doubtful:
            print(f"# doubtful: {keypoint} ({seen.guess.scores[keypoint]:.2f})")
        print(f"# joints that play none: {', '.join(seen.guess.unused) or 'none'}")
        print(text, end="")
