"""The report of a reference on one page: margins, contact schedule and energy over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from omni_envs.errors import InvalidDataError, InvalidOptionError, MissingDependencyError
from omni_envs.metrics import ReferenceReport
from omni_envs.references.reference import Reference
from omni_envs.robots import SIDES, get_robot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SUFFIXES = (".pdf", ".png", ".svg")

_PAGE = (8.27, 11.69)  # A4, inches
_HEIGHTS = (1.3, 1.3, 1.0, 1.1, 1.8, 1.1)
# Colours that colour-blind readers tell apart (Okabe, Ito).
_TARGETS = {"object": "#D55E00", "terrain": "#009E73", "ground": "#0072B2", "self": "#CC79A7"}
_FEET = ("#0072B2", "#D55E00")
_DARK, _LIGHT, _LIMIT, _ALARM = "#333333", "#BBBBBB", "#888888", "#CC0000"


def report_picture(reference: Reference, path: str | Path) -> Path:
    """Draws the report of a reference.

    From top to bottom, over time: depth of penetration, slip and drift of planted feet, use of
    joint ranges and speed limits, contact schedule, deformation energy. Red marks on top are frames
    on which the solver gave a constraint up.

    Args:
        reference: A reference with a report.
        path: ``.png``, ``.pdf`` or ``.svg``.

    Returns:
        The path.

    Raises:
        InvalidOptionError: Another suffix.
        InvalidDataError: The reference has no report.
        MissingDependencyError: matplotlib is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InvalidOptionError(f"{path}: must end in one of {SUFFIXES}; got {path.suffix!r}.")
    report = reference.report
    if report is None:
        raise InvalidDataError("Report picture", "report", "there (see evaluate_reference)", "None")
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError("matplotlib", "viewer", "A picture of a report") from error
    figure = Figure(figsize=_PAGE, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(_HEIGHTS), 1, sharex=True, height_ratios=_HEIGHTS)
    time = np.arange(report.num_frames) / report.fps
    _penetration(axes[0], time, report)
    _slip(axes[1], time, report)
    _drift(axes[2], time, report)
    _joints(axes[3], time, reference)
    _contact(axes[4], time, report)
    _energy(axes[5], time, report)
    for axis in axes:
        axis.margins(x=0)
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8)
        if report.relaxed is not None and report.relaxed.any():
            marks = np.ones(int(report.relaxed.sum()))
            top = axis.get_xaxis_transform()
            axis.plot(time[report.relaxed], marks, "|", color=_ALARM, transform=top, clip_on=False)
    axes[-1].set_xlabel("time (s)", fontsize=9)
    name = reference.provenance.get("demonstration", "motion")
    title = f"{name} → {get_robot(reference.robot).title}"
    relaxed = "" if report.relaxed is None else f", {int(report.relaxed.sum())} relaxed"
    figure.suptitle(
        f"{title}    {report.num_frames} frames at {report.fps:g} fps{relaxed}", fontsize=11
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    return path


def _label(axis: Axes, title: str, unit: str) -> None:
    axis.set_title(title, fontsize=9, loc="left", color=_DARK)
    axis.set_ylabel(unit, fontsize=8)


def _legend(axis: Axes, **options: Any) -> None:
    if axis.get_legend_handles_labels()[0]:
        options = {"fontsize": 7, "frameon": False, "ncols": 4, "loc": "upper right", **options}
        axis.legend(**options)


def _penetration(axis: Axes, time: np.ndarray, report: ReferenceReport) -> None:
    for target, depth in report.penetration.items():
        axis.plot(time, 1e3 * depth, color=_TARGETS[target], label=f"{target}", lw=1.0)
    axis.axhline(1.0, color=_LIMIT, ls=":", lw=0.8)
    axis.set_ylim(bottom=0.0, top=max(1.5, axis.get_ylim()[1]))
    worst = ", ".join(f"{k} {1e3 * v.max():.2g}" for k, v in report.penetration.items())
    _label(axis, f"penetration — worst (mm): {worst}; dotted: 1 mm", "mm")
    _legend(axis)


def _slip(axis: Axes, time: np.ndarray, report: ReferenceReport) -> None:
    planted = report.stance.get("default")
    for foot, side in enumerate(SIDES):
        axis.plot(time, 100 * report.slip[:, foot], color=_LIGHT, lw=0.7, zorder=1)
        if planted is not None:
            slip = np.where(planted[:, foot], 100 * report.slip[:, foot], np.nan)
            axis.plot(time, slip, color=_FEET[foot], lw=1.2, label=f"{side} planted", zorder=2)
    axis.axhline(1.0, color=_LIMIT, ls=":", lw=0.8)
    speeds = report.planted_slip("default")
    top = 100 * speeds.max() if speeds is not None and speeds.size else 0.0
    axis.set_ylim(0.0, max(2.0, 1.2 * top))
    _label(axis, "slip of the slowest sole point — grey: foot in motion; dotted: 1 cm/s", "cm/s")
    _legend(axis)


def _drift(axis: Axes, time: np.ndarray, report: ReferenceReport) -> None:
    if "default" in report.drift:
        for foot, side in enumerate(SIDES):
            centre, pivot = (
                1e3 * d["default"][:, foot] for d in (report.drift, report.pivot_drift)
            )
            axis.plot(time, centre, color=_FEET[foot], lw=1.0, label=f"{side} sole centre")
            axis.plot(time, pivot, color=_FEET[foot], lw=1.0, ls="--", label=f"{side} pivot")
    axis.axhline(2.0, color=_LIMIT, ls=":", lw=0.8)
    axis.set_ylim(0.0, max(3.0, axis.get_ylim()[1]))
    _label(axis, "drift since the stance began — dashed: without rolling; dotted: 2 mm", "mm")
    _legend(axis)


def _joints(axis: Axes, time: np.ndarray, reference: Reference) -> None:
    robot = get_robot(reference.robot)
    low, high = robot.joint_ranges.T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    position = (np.abs(reference.joint_positions - middle) / half).max(axis=1)
    steps = np.abs(
        np.diff(reference.joint_positions, axis=0, prepend=reference.joint_positions[:1])
    )
    speed = (steps * reference.fps / robot.velocity_limits).max(axis=1)
    axis.plot(time, 100 * position, color=_FEET[0], lw=1.0, label="range")
    axis.plot(time, 100 * speed, color=_FEET[1], lw=1.0, label="speed")
    axis.axhline(100.0, color=_ALARM, ls=":", lw=0.8)
    axis.set_ylim(0.0, max(130.0, axis.get_ylim()[1]))
    _label(axis, "joint nearest its limit, of the mechanical range and of the motor's speed", "%")
    _legend(axis)


def _contact(axis: Axes, time: np.ndarray, report: ReferenceReport) -> None:
    links = [link for link, wanted in report.contact.items() if wanted.any()]
    rows: list[tuple[str, np.ndarray, np.ndarray]] = [
        (link, report.contact[link], report.contact_distance[link] <= 0.02) for link in links
    ]
    for foot, side in enumerate(SIDES):
        if "default" in report.stance:
            planted = report.stance["default"][:, foot]
            rows.append((f"{side} stance", planted, report.slip[:, foot] <= 0.01))
    step = 1.0 / report.fps
    for row, (_, wanted, kept) in enumerate(rows):
        for flags, colour, height in (
            (wanted & kept, "#009E73", 0.7),
            (wanted & ~kept, _ALARM, 0.7),
            (~wanted & kept, _LIGHT, 0.25),
        ):
            spans = [(t - 0.5 * step, step) for t in time[flags]]
            axis.broken_barh(spans, (row - 0.5 * height, height), color=colour, lw=0)
    axis.set_yticks(range(len(rows)), [name.replace("_", " ") for name, _, _ in rows])
    axis.set_ylim(len(rows) - 0.4, -0.6)
    share = report.summary()["contact_fraction_2cm"]
    told = "" if share is None else f" — {100 * share:.1f} % of contacts within 2 cm"
    _label(axis, f"contact and stance: green kept, red missed, thin grey unasked{told}", "")


def _energy(axis: Axes, time: np.ndarray, report: ReferenceReport) -> None:
    if report.energy is not None:
        axis.plot(time, 1e3 * report.energy, color=_DARK, lw=1.0)
        mean, worst = 1e3 * report.energy.mean(), 1e3 * report.energy.max()
        _label(axis, f"deformation energy — mean {mean:.1f}, largest {worst:.1f}", "10⁻³ m²")
    else:
        _label(axis, "deformation energy — no source", "10⁻³ m²")
    axis.set_ylim(bottom=0.0)
