"""A report condensed to single figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from omni_envs.demonstrations import STANCE_MODES
from omni_envs.metrics.playback import SELF
from omni_envs.metrics.report import (
    CLEAN,
    SLIPPING,
    TOUCHING,
    ReferenceReport,
)

if TYPE_CHECKING:
    from rich.table import Table

Figures = dict[str, float | int | None]


def summarize(report: ReferenceReport) -> Figures:
    """Returns the headline figures, SI units; None where one is not defined for this motion.

    - ``penetration_*``: object, terrain and ground; ``self_penetration_max_m`` the robot with
    itself. - ``slip_fraction_*``: share of planted foot-frames of that stance set whose slip is
    above 1 cm/s;
      ``slip_max_code_m_s``: fastest slip in the widest set.
    - ``stance_drift_max_m``: of the sole centre, in the ``default`` set, rolling counted;
      ``stance_still_drift_max_m``: the same where the human's foot neither rolls nor turns;
      ``stance_pivot_drift_max_m``: of the sole point that moved least, so without rolling.
    - ``stance_clearance_max_m``: how far the farthest sole point is off the support, of the worst
      stance in which the human stands on the whole sole (``default`` set).
    - ``contact_fraction_2cm``: share of (link, frame) that the human touches with and the robot is
      within 2 cm; ``contact_clean_fraction``: and the link is at most 1 cm deep.
    - ``energy_*``: deformation energy, weight 1, m².
    """
    depth = report.surroundings_penetration
    desired, touched = _pooled(report, TOUCHING)
    _, clean = _pooled(report, TOUCHING, CLEAN)
    return {
        "frames": report.num_frames,
        "fps": float(report.fps),
        "penetration_max_m": float(depth.max()),
        "penetration_fraction_1mm": float(np.mean(depth > 1e-3)),
        "slip_fraction_text": _slip_fraction(report, "text", SLIPPING),
        "slip_fraction_default": _slip_fraction(report, "default", SLIPPING),
        "slip_max_code_m_s": _max(report.planted_slip("code")),
        "stance_drift_max_m": _max(report.drift.get("default")),
        "stance_still_drift_max_m": _max(report.still_drift.get("default")),
        "stance_pivot_drift_max_m": _max(report.pivot_drift.get("default")),
        "stance_clearance_max_m": _max(report.clearance.get("default")),
        "self_penetration_max_m": float(report.penetration[SELF].max()),
        "joint_violation_max_rad": float(report.joint_violation.max()),
        "velocity_violation_max_rad_s": float(report.velocity_violation.max()),
        "contact_fraction_2cm": _ratio(touched, desired),
        "contact_clean_fraction": _ratio(clean, desired),
        "contact_point_gap_mean_m": _mean(report.contact_gap.values()),
        "energy_mean": _mean([report.energy]),
        "energy_max": _max(report.energy),
        "joint_acceleration_rms": _rms(report.joint_acceleration),
        "relaxed_frames": None if report.relaxed is None else int(report.relaxed.sum()),
    }


def details(report: ReferenceReport) -> Figures:
    """Returns all other figures: every column, threshold and link by itself."""
    figures: Figures = {}
    for target, depth in report.penetration.items():
        figures[f"penetration_{target}_max_m"] = float(depth.max())
        for millimetres in (1, 5, 10):
            share = float(np.mean(depth > 1e-3 * millimetres))
            figures[f"penetration_{target}_fraction_{millimetres}mm"] = share
        deep = depth[depth > 0.01]
        figures[f"penetration_{target}_mean_over_10mm_m"] = (
            float(deep.mean()) if deep.size else None
        )
    for mode in STANCE_MODES:
        if mode not in report.stance:
            continue
        slip = report.planted_slip(mode)
        figures[f"stance_fraction_{mode}"] = float(report.stance[mode].mean())
        for speed in (1, 10, 30):
            key = f"slip_fraction_{mode}_{speed}cm_s"
            figures[key] = _slip_fraction(report, mode, 0.01 * speed)
        figures[f"slip_mean_{mode}_m_s"] = _mean([slip])
        figures[f"slip_max_{mode}_m_s"] = _max(slip)
        figures[f"stance_drift_max_{mode}_m"] = _max(report.drift[mode])
        figures[f"stance_still_drift_max_{mode}_m"] = _max(report.still_drift.get(mode))
        figures[f"stance_pivot_drift_max_{mode}_m"] = _max(report.pivot_drift[mode])
        figures[f"stance_clearance_max_{mode}_m"] = _max(report.clearance.get(mode))
    for centimetres in (1, 2, 5):
        near = 0.01 * centimetres
        if near != TOUCHING:  # that one is in the summary
            desired, touched = _pooled(report, near)
            figures[f"contact_fraction_{centimetres}cm"] = _ratio(touched, desired)
        figures[f"contact_all_fraction_{centimetres}cm"] = _contact_all(report, near)
        for link, wanted in report.contact.items():
            touching = wanted & (report.contact_distance[link] <= near)
            key = f"contact_fraction_{link}_{centimetres}cm"
            figures[key] = _ratio(int(touching.sum()), int(wanted.sum()))
    figures["contact_point_gap_max_m"] = _max(
        np.concatenate([np.zeros(0), *report.contact_gap.values()])
    )
    figures["keypoint_error_mean_m"] = _mean([report.keypoint_error])
    figures["joint_speed_max_rad_s"] = float(report.joint_speed.max())
    figures["joint_acceleration_max_rms"] = _max(report.joint_acceleration)
    figures["joint_jerk_rms"] = _rms(report.joint_jerk)
    return figures


def summary_table(
    columns: Mapping[str, Mapping[str, float | int | None]], title: str = ""
) -> Table:
    """Returns figures as a table for people: one row a figure, one column a motion.

    Args:
        columns: Heading to figures, as ``summarize`` returns them.
        title: Title of the table.
    """
    from rich.table import Table

    table = Table(title=title or None, title_justify="left")
    table.add_column("figure")
    for heading in columns:
        table.add_column(heading, justify="right")
    names = dict.fromkeys(name for figures in columns.values() for name in figures)
    for name in names:
        cells = [_cell(figures.get(name)) for figures in columns.values()]
        table.add_row(name, *cells)
    return table


def _cell(value: float | int | None) -> str:
    if value is None:
        return "–"
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def _pooled(report: ReferenceReport, near: float, deep: float = np.inf) -> tuple[int, int]:
    """Numbers of (link, frame) with desired contact, and of those touched, not too deep."""
    desired = touched = 0
    for link, wanted in report.contact.items():
        distance = report.contact_distance[link]
        desired += int(wanted.sum())
        touched += int((wanted & (distance <= near) & (report.contact_depth[link] <= deep)).sum())
    return desired, touched


def _contact_all(report: ReferenceReport, near: float) -> float | None:
    if not report.contact:
        return None
    wanted = np.stack(list(report.contact.values()))
    touched = np.stack([report.contact_distance[link] <= near for link in report.contact])
    any_wanted = wanted.any(axis=0)
    return _ratio(int((any_wanted & (touched | ~wanted).all(axis=0)).sum()), int(any_wanted.sum()))


def _slip_fraction(report: ReferenceReport, mode: str, speed: float) -> float | None:
    slip = report.planted_slip(mode)
    return None if slip is None or not slip.size else float(np.mean(slip > speed))


def _ratio(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _max(values: np.ndarray | None) -> float | None:
    return None if values is None or np.isnan(values).all() else float(np.nanmax(values))


def _mean(values: Iterable[np.ndarray | None]) -> float | None:
    present = np.concatenate([np.zeros(0), *(v for v in values if v is not None)])
    present = present[~np.isnan(present)]
    return float(present.mean()) if present.size else None


def _rms(values: np.ndarray) -> float | None:
    return None if np.isnan(values).all() else float(np.sqrt(np.nanmean(values**2)))
