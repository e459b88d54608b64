"""What a motion is held to: limits on its headline figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

_EXACT = 1e-6  # rounding of a figure that should be 0


@dataclass(frozen=True)
class Bar:
    """A limit on one headline figure.

    Attributes:
        name: What people call the figure.
        figure: Its key in a report's summary or details.
        limit: The limit, SI units.
        factor: From SI units to those of ``name``.
        least: The figure must be at least the limit, not at most.
    """

    name: str
    figure: str
    limit: float
    factor: float = 1.0
    least: bool = False

    def holds(self, figures: Mapping[str, float | int | None]) -> bool | None:
        """Whether the figures meet the bar; None where this one is not defined for the motion."""
        value = figures.get(self.figure)
        if value is None:
            return None
        return value >= self.limit if self.least else value <= self.limit


BARS = (
    Bar("penetration, mm", "penetration_max_m", 1e-3, 1e3),
    Bar("self-penetration, mm", "self_penetration_max_m", 1e-3, 1e3),
    Bar("slip > 1 cm/s, text stance, %", "slip_fraction_text", 0.01, 100.0),
    Bar("slip > 1 cm/s, default stance, %", "slip_fraction_default", 0.01, 100.0),
    Bar("slip, code stance, cm/s", "slip_max_code_m_s", 0.10, 100.0),
    Bar("stance drift, sole centre, mm", "stance_still_drift_max_m", 2e-3, 1e3),
    Bar("stance drift, pivot, mm", "stance_pivot_drift_max_m", 2e-3, 1e3),
    Bar("clearance of flat soles, mm", "stance_clearance_max_m", 0.01, 1e3),
    Bar("joint limits exceeded, rad", "joint_violation_max_rad", _EXACT),
    Bar("speed limits exceeded, rad/s", "velocity_violation_max_rad_s", _EXACT),
    Bar("contact, clean, %", "contact_clean_fraction", 0.98, 100.0, least=True),
    Bar("contact-point gap, cm", "contact_point_gap_mean_m", 0.02, 100.0),
)
"""The bars every reference is held to.

The sole centre of a foot that rolls onto its toes with the human moves though nothing slides: it
is held to its bar where the human's foot keeps its direction, the pivot everywhere. What rolling
adds stands below the bars.
"""

_PLAIN = (
    ("drift, sole centre, rolling counted, mm", "stance_drift_max_m", 1e3),
    ("contact, %", "contact_fraction_2cm", 100.0),
    ("energy, mean, ×10⁻³", "energy_mean", 1e3),
    ("energy, max, ×10⁻³", "energy_max", 1e3),
    ("joint acceleration, rms, rad/s²", "joint_acceleration_rms", 1.0),
    ("relaxed frames", "relaxed_frames", 1.0),
    ("frames", "frames", 1.0),
    ("frames per second", "fps", 1.0),
)


def bars_table(columns: Mapping[str, Mapping[str, float | int | None]], title: str = "") -> Table:
    """Returns the bars as a table for people: one column a motion, ✓ or ✗ at every figure.

    Args:
        columns: Heading to figures, as a report's ``summary`` returns them.
        title: Title of the table.
    """
    from rich.table import Table

    table = Table(title=title or None, title_justify="left")
    table.add_column("figure")
    table.add_column("bar", justify="right")
    for heading in columns:
        table.add_column(heading, justify="right", overflow="fold")
    for bar in BARS:
        limit = f"{'≥' if bar.least else '≤'} {bar.factor * bar.limit:g}"
        cells = [_cell(bar, figures) for figures in columns.values()]
        table.add_row(bar.name, limit, *cells)
    table.add_section()
    for name, figure, factor in _PLAIN:
        values = [figures.get(figure) for figures in columns.values()]
        cells = ["–" if value is None else f"{factor * value:.4g}" for value in values]
        table.add_row(name, "", *cells)
    return table


def _cell(bar: Bar, figures: Mapping[str, float | int | None]) -> str:
    value, holds = figures.get(bar.figure), bar.holds(figures)
    if value is None:
        return "–"
    mark = "[green]✓[/green]" if holds else "[red]✗[/red]"
    return f"{bar.factor * value:.3g} {mark}"
