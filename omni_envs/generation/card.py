"""The card of a dataset: what is in it, how good it is, where it comes from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from omni_envs.errors import MissingDependencyError, RenderingError
from omni_envs.files import complete_file
from omni_envs.generation.item import DONE
from omni_envs.references import Reference

FIGURES = {
    "penetration_max_m": ("deepest penetration", "mm", 1e3),
    "slip_fraction_default": ("planted feet that slip", "%", 1e2),
    "stance_still_drift_max_m": ("drift of planted feet", "mm", 1e3),
    "contact_clean_fraction": ("clean contact", "%", 1e2),
    "contact_point_gap_mean_m": ("distance to the touched point", "cm", 1e2),
    "energy_mean": ("deformation energy", "×10⁻³", 1e3),
    "joint_acceleration_rms": ("rms joint acceleration", "rad/s²", 1.0),
}
"""Keys of a summary to (title, unit, factor)."""

HISTOGRAMS, PREVIEWS = "histograms.png", "previews"


def write_card(out: str | Path, rows: Iterable[dict[str, Any]], *, previews: int = 12) -> Path:
    """Writes ``README.md`` with a table, histograms and previews beside it.

    Args:
        out: Folder of the dataset.
        rows: Rows of its manifest.
        previews: Most preview pictures, of unvaried references.

    Returns:
        The path of the card.
    """
    out = Path(out)
    rows = sorted(rows, key=lambda row: row["name"])
    done = [row for row in rows if row["status"] == DONE and (out / row["file"]).is_file()]
    failed = [row for row in rows if row["status"] != DONE]
    seconds = sum(row["duration_s"] for row in done)
    work = sum(row["cpu_seconds"] for row in done)
    frames = sum(row["frames"] for row in done)
    lines = [
        "# Reference motions",
        "",
        f"{len(done)} references, {seconds / 60:.1f} minutes of robot motion, made by omni_envs. "
        "Every file is a `Reference` (`omni_envs.references.Reference.load`) that carries its "
        "scene, its source and the proof of its constraints.",
        "",
    ]
    if work:
        lines += [
            f"{frames} frames took {work:.0f} s of one core: {frames / work:.0f} frames/s.",
            "",
        ]
    lines += _histograms(out, done) + _previews(out, done, previews)
    lines += ["## Sources", ""]
    lines += [
        f"- {source or 'unknown'}: {count} references. Licence: {licence or 'unknown'}."
        for (source, licence), count in Counter((r["source"], r["licence"]) for r in done).items()
    ]
    titles = [f"{title} ({unit})" for title, unit, _ in FIGURES.values()]
    lines += ["", "## Files", "", f"| reference | s | {' | '.join(titles)} | relaxed frames |"]
    lines += ["|---" * (len(titles) + 3) + "|"]
    for row in done:
        cells = [_cell(row["summary"].get(key), factor) for key, (_, _, factor) in FIGURES.items()]
        name, relaxed = f"[{row['name']}]({row['file']})", row["summary"]["relaxed_frames"]
        lines.append(f"| {name} | {row['duration_s']:.1f} | {' | '.join(cells)} | {relaxed} |")
    if failed:
        lines += ["", "## Not made", ""]
        lines += [f"- {row['name']}: {row['message']}" for row in failed]
    out.mkdir(parents=True, exist_ok=True)
    with complete_file(out / "README.md") as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return out / "README.md"


def _cell(value: float | None, factor: float) -> str:
    return "–" if value is None else f"{factor * value:.3g}"


def _histograms(out: Path, done: list[dict[str, Any]]) -> list[str]:
    if not done:
        return []
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        return ["*No histograms: matplotlib is not installed (omni-envs[viewer]).*", ""]
    figure = Figure(figsize=(10, 5), layout="constrained")
    FigureCanvasAgg(figure)
    for axis, (key, (title, unit, factor)) in zip(
        figure.subplots(2, 4).flat, FIGURES.items(), strict=False
    ):
        values = [row["summary"][key] for row in done if row["summary"].get(key) is not None]
        axis.hist(factor * np.array(values, float), bins=20, color="#0072B2")
        axis.set_title(title, fontsize=9)
        axis.set_xlabel(unit, fontsize=8)
        axis.tick_params(labelsize=7)
    figure.axes[-1].set_axis_off()
    with complete_file(out / HISTOGRAMS) as temporary:
        figure.savefig(temporary, dpi=120, format="png")
    return [f"![How good the references are]({HISTOGRAMS})", ""]


def _previews(out: Path, done: list[dict[str, Any]], most: int) -> list[str]:
    from omni_envs.viewer import reference_strip

    shown = [row for row in done if row["name"].endswith("/nominal")][:most]
    lines = ["## Previews", ""] if shown else []
    for row in shown:
        path = out / PREVIEWS / (row["name"].replace("/", "_") + ".png")
        try:
            if not path.is_file() or path.stat().st_mtime < (out / row["file"]).stat().st_mtime:
                reference = Reference.load(out / row["file"])
                reference_strip(reference, path, pictures=6, columns=6, colours=256)
        except (MissingDependencyError, RenderingError) as error:
            return [*lines, f"*No previews: {error}*", ""]
        lines += [row["name"], "", f"![{row['name']}]({path.relative_to(out).as_posix()})", ""]
    return lines
